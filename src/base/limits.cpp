// SPDX-License-Identifier: Apache-2.0
#include "base/limits.h"

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

void set_limits(const Limits& limits) {
    limits_of_process() = limits;
}

}  // namespace velatura
