/* A CUDA driver without a GPU: it has a machine's memory, writes kernels, as text in PTX, into the
   folder $PTX_FOLDER instead of loading them, and launches nothing. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DOES_NOTHING(name) int name(void) { return 0; }
#define GIVES(name) int name(void **it) { *it = (void *)64; return 0; }
DOES_NOTHING(cuInit) DOES_NOTHING(cuCtxSetCurrent) DOES_NOTHING(cuCtxSetLimit)
DOES_NOTHING(cuEventDestroy) DOES_NOTHING(cuEventElapsedTime) DOES_NOTHING(cuEventRecord)
DOES_NOTHING(cuEventSynchronize) DOES_NOTHING(cuExternalMemoryGetMappedBuffer)
DOES_NOTHING(cuExternalMemoryGetMappedMipmappedArray) DOES_NOTHING(cuFuncSetAttribute)
DOES_NOTHING(cuGetErrorName) DOES_NOTHING(cuGetErrorString) DOES_NOTHING(cuImportExternalMemory)
DOES_NOTHING(cuImportExternalSemaphore) DOES_NOTHING(cuLaunchKernel) DOES_NOTHING(cuMemAdvise)
DOES_NOTHING(cuMemPoolSetAttribute) DOES_NOTHING(cuMemsetD32_v2) DOES_NOTHING(cuMemsetD8_v2)
DOES_NOTHING(cuMipmappedArrayGetLevel) DOES_NOTHING(cuSignalExternalSemaphoresAsync)
DOES_NOTHING(cuStreamDestroy) DOES_NOTHING(cuStreamSynchronize) DOES_NOTHING(cuSurfObjectCreate)
DOES_NOTHING(cuWaitExternalSemaphoresAsync)
GIVES(cuCtxCreate_v2) GIVES(cuCtxGetCurrent) GIVES(cuDevicePrimaryCtxRetain) GIVES(cuEventCreate)
GIVES(cuDeviceGetDefaultMemPool) GIVES(cuModuleGetFunction) GIVES(cuStreamCreate)

int cuCtxGetDevice(int *device) { *device = 0; return 0; }
int cuDeviceGet(int *device, int number) { *device = number; return 0; }
int cuDeviceGetCount(int *n) { *n = 1; return 0; }
int cuDeviceGetName(char *name, int size, int device) { strncpy(name, "none", size); return 0; }
int cuDriverGetVersion(int *version) { *version = 12000; return 0; }
int cuFuncGetAttribute(int *value, int what, void *kernel) { *value = 1024; return 0; }
int cuPointerGetAttribute(void *value, int what, void *pointer) { return 1; }  /* not a GPU's */

int cuDeviceGetAttribute(int *value, int what, int device) {
    /* Threads of a block, multiprocessors, compute capability 9.0, blocks of a multiprocessor. */
    *value = what == 1 ? 1024 : what == 16 ? 132 : what == 75 ? 9 : what == 106 ? 32 : 0;
    return 0;
}

int cuOccupancyMaxActiveBlocksPerMultiprocessor(int *n, void *kernel, int threads, size_t shared) {
    *n = 16;
    return 0;
}

int cuMemGetInfo_v2(size_t *unused, size_t *all) { *unused = *all = (size_t)1 << 33; return 0; }
int cuMemAlloc_v2(void **memory, size_t size) { *memory = calloc(1, size + 1); return 0; }
int cuMemAllocAsync(void **memory, size_t size, void *s) { return cuMemAlloc_v2(memory, size); }
int cuMemAllocManaged(void **memory, size_t size, int f) { return cuMemAlloc_v2(memory, size); }
int cuMemFree_v2(void *memory) { free(memory); return 0; }
int cuMemFreeAsync(void *memory, void *stream) { return cuMemFree_v2(memory); }

int cuMemcpyDtoD_v2(void *to, const void *from, size_t size) {
    if (to && from) memcpy(to, from, size);  /* kernels that find addresses did not run */
    if (to && !from) memset(to, 0, size);
    return 0;
}
int cuMemcpyDtoH_v2(void *to, void *from, size_t n) { return cuMemcpyDtoD_v2(to, from, n); }
int cuMemcpyHtoD_v2(void *to, void *from, size_t n) { return cuMemcpyDtoD_v2(to, from, n); }
int cuMemcpyDtoHAsync_v2(void *to, void *from, size_t n) { return cuMemcpyDtoD_v2(to, from, n); }
int cuMemcpyHtoDAsync_v2(void *to, void *from, size_t n) { return cuMemcpyDtoD_v2(to, from, n); }

int cuModuleLoadDataEx(void **module, const char *ptx, int n, void *options, void *values) {
    static int number;
    char name[4096];
    snprintf(name, sizeof name, "%s/%d.ptx", getenv("PTX_FOLDER"), number++);
    FILE *file = fopen(name, "w");
    fputs(ptx, file);
    fclose(file);
    *module = (void *)64;
    return 0;
}
