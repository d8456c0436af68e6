// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/resource.h>

#include <cstddef>

namespace velatura {
inline namespace process {

/// Whether a limit on addresses can be kept: sanitizers reserve more of them than any limit.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool limits_addresses = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool limits_addresses = false;
#else
inline constexpr bool limits_addresses = true;
#endif
#else
inline constexpr bool limits_addresses = true;
#endif

/// Address space of this process.
size_t address_bytes();

/// For this process and those that it starts; what they must not exceed already stays below it.
void set_limit(__rlimit_resource resource, size_t value);

}  // namespace process
}  // namespace velatura
