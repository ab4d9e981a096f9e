/* Memory for WebAssembly, which has no library. `free` also frees all that was allocated later. */
#include <stddef.h>
#include <stdint.h>

extern unsigned char __heap_base;
static unsigned char *heap_top = &__heap_base;

static inline void *malloc(size_t bytes)
{
    unsigned char *found = (unsigned char *)(((size_t)heap_top + 15) & ~(size_t)15);
    size_t end = (size_t)found + bytes, room = __builtin_wasm_memory_size(0) * 65536;
    if (end > room && __builtin_wasm_memory_grow(0, (end - room + 65535) / 65536) == (size_t)-1)
        return NULL;
    heap_top = (unsigned char *)end;
    return found;
}

static inline void *calloc(size_t n, size_t bytes)
{
    void *found = malloc(n * bytes);
    return found ? __builtin_memset(found, 0, n * bytes) : NULL;
}

static inline void free(void *found)
{
    if (found && (unsigned char *)found < heap_top)
        heap_top = found;
}
