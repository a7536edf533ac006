#pragma once

/// THERMBAL_EVERY_WIDTH compiles a function once for every width of vector unit and chooses at run time.
/// Not under a sanitizer: the choice is made before the sanitizer is there.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define THERMBAL_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define THERMBAL_SANITIZED
#endif
#endif
#if defined(__x86_64__) && defined(__GNUC__) && !defined(THERMBAL_SANITIZED)
#define THERMBAL_EVERY_WIDTH __attribute__((target_clones("avx512f", "avx2", "default")))
#define THERMBAL_WIDTHS_OF_X86
#else
#define THERMBAL_EVERY_WIDTH
#endif
