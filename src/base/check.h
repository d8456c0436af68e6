// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace velatura {

/// Prints the broken promise to stderr and aborts: a bug of ours, never the user's data.
[[noreturn]] void check_failed(const char* condition,
                               const char* message,
                               const char* file,
                               int line);

}  // namespace velatura

/// A promise of our own code; on in every build.
#define VELATURA_CHECK(condition, message) \
    ((condition) ? void(0) : ::velatura::check_failed(#condition, message, __FILE__, __LINE__))

/// The same inside inner loops; on only in the presets dev, asan and tsan.
#ifdef VELATURA_DEBUG_CHECKS
#define VELATURA_DCHECK(condition, message) VELATURA_CHECK(condition, message)
#else
#define VELATURA_DCHECK(condition, message) void(0)
#endif
