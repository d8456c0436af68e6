// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/value_reader.h"

#include "usd/crate/arrays.h"

#include <fmt/format.h>

namespace velatura::usd::crate {

bool ValueReader::read(ValueRep rep, layer::Value& out) {
    if (rep.is_array_edit()) {
        return context_.fail(rep.payload(), "found an edit of an array, expected a value");
    }
    if (rep.is_array())
        return read_array(context_.file, rep, context_.is_sample, out, context_.problem);
    if (context_.depth >= max_value_depth) {
        return context_.fail(
            rep.payload(),
            fmt::format("found more than {} levels of values, limit reached", max_value_depth));
    }
    ++context_.depth;
    const bool ok = read_deeper(rep, out);
    --context_.depth;
    return ok;
}

bool ValueReader::read_deeper(ValueRep rep, layer::Value& out) {
    bool is_scalar = false;
    const bool ok = scalars_.read(rep, out, is_scalar);
    if (is_scalar) return ok;
    if (rep.is_inlined()) {
        return context_.fail(0, fmt::format("found an inlined value of type {}, expected an offset",
                                            int(rep.type())));
    }
    return fields_.read(rep, out);
}

}  // namespace velatura::usd::crate
