#pragma once

#include <cstdio>
#include <cstdlib>

/// What a fuzz target asserts beyond "no crash, no hang, no leak". Stays in optimised builds.
#define FUZZ_CHECK(condition)                                                            \
    do {                                                                                 \
        if (!(condition)) {                                                              \
            std::fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            std::abort();                                                                \
        }                                                                                \
    } while (false)
