// Preloaded into a daemon: while the file that THERMBAL_HOLD_<CALL> names is there, the call does not come
// back. A disk or a bus that hangs in the kernel, as no simulated fault can do it.
#include <cstdlib>

#include <dlfcn.h>
#include <sys/select.h>
#include <unistd.h>

namespace {

void hold_while_there(const char* variable) {
    const char* file = std::getenv(variable);
    while (file != nullptr && access(file, F_OK) == 0) usleep(20'000);
}

template <class Function>
Function next(const char* name) {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int fdatasync(int file) {
    hold_while_there("THERMBAL_HOLD_STORE");
    return next<int (*)(int)>("fdatasync")(file);
}

int fsync(int file) {
    hold_while_there("THERMBAL_HOLD_STORE");
    return next<int (*)(int)>("fsync")(file);
}

ssize_t recv(int socket, void* buffer, size_t bytes, int flags) {
    if (flags == 0) hold_while_there("THERMBAL_HOLD_LINE");
    return next<ssize_t (*)(int, void*, size_t, int)>("recv")(socket, buffer, bytes, flags);
}
}
