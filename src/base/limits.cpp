// SPDX-License-Identifier: Apache-2.0
#include "base/limits.h"

#include "base/process/memory_limit.h"

namespace velatura {

namespace {

Limits& limits_of_process() {
    static Limits limits;
    return limits;
}

}  // namespace

const Limits& limits() {
    return limits_of_process();
}

DecodeLimits decode_limits() {
    DecodeLimits decoding = limits().decoding;
    // Several are open at once
    constexpr size_t share = 8;
    if (MemoryLimit::is_set()) decoding.in_process_bytes = MemoryLimit::left() / share;
    return decoding;
}

void set_limits(const Limits& limits) {
    limits_of_process() = limits;
}

}  // namespace velatura
