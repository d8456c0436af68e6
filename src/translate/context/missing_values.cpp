// SPDX-License-Identifier: Apache-2.0
#include "translate/context/missing_values.h"

#include <fmt/format.h>

namespace velatura::translate {
inline namespace context {

namespace {

/// The value is an array of no elements that somebody authored.
bool is_authored_empty(const Attribute& attribute, TimeCode time) {
    return attribute.has_authored_value() && attribute.value(time).is_array() &&
           attribute.value(time).array_size() == 0;
}

}  // namespace

std::string missing_array(const Attribute& attribute, TimeCode time) {
    using usd::stage::ValueSource;
    const usd::layer::Value value = attribute.value(time);
    if (value.array_size() > 0) return {};
    const std::string name = attribute.name().str();
    const ValueSource source = attribute.value_source();
    if (source == ValueSource::Blocked) return name + " is blocked (None)";
    if (!attribute.has_authored_value()) return name + " is not authored";
    if (is_authored_empty(attribute, time)) return name + " is empty";
    const bool is_animated = source == ValueSource::TimeSamples || source == ValueSource::Spline ||
                             source == ValueSource::Clips;
    if (is_animated && time.is_default())
        return name + " has time samples only, and no value at the default time";
    if (is_animated && (value.is_empty() || value.is_block()))
        return fmt::format("{} has no value at time {}", name, time.value());
    return name + " is not an array";
}

bool lacks_array(Context& ctx,
                 Prim prim,
                 std::initializer_list<const char*> names,
                 const char* code) {
    for (const char* name : names) {
        const Attribute attribute = prim.attribute(name);
        const std::string reason = missing_array(attribute, ctx.time);
        if (reason.empty()) continue;
        if (!is_authored_empty(attribute, ctx.time))
            ctx.warn(code, attribute,
                     fmt::format("{}; the {} is skipped", reason, prim.type_name().str()));
        return true;
    }
    return false;
}

}  // namespace context
}  // namespace velatura::translate
