#include "name_service.hpp"

#include <atomic>

#include <dlfcn.h>
#include <grp.h>
#include <pwd.h>

namespace {

std::atomic<int> calls = 0;

/// The C library's own.
template <typename Function>
Function* real(const char* name) {
    ++calls;
    return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

namespace thermbal::test {

int name_service_calls() {
    return calls;
}

}  // namespace thermbal::test

// These stand before the C library's.
extern "C" {

int getgrnam_r(const char* name, group* entry, char* buffer, size_t size, group** found) {
    return real<decltype(getgrnam_r)>("getgrnam_r")(name, entry, buffer, size, found);
}

int getpwuid_r(uid_t uid, passwd* entry, char* buffer, size_t size, passwd** found) {
    return real<decltype(getpwuid_r)>("getpwuid_r")(uid, entry, buffer, size, found);
}

int getgrouplist(const char* user, gid_t group, gid_t* groups, int* count) {
    return real<decltype(getgrouplist)>("getgrouplist")(user, group, groups, count);
}

}  // extern "C"
