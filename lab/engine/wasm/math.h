/* Instructions of WebAssembly. */
#define floor __builtin_floor
#define INFINITY __builtin_inff()
