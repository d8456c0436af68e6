// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/field_reader.h"

#include "usd/crate/spline_bytes.h"
#include "usd/crate/time_samples.h"
#include "usd/crate/value_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::usd::crate {

using layer::Value;

template <class T>
bool FieldReader::read_list_op(Cursor& c, Value& out) {
    layer::ListOp<T> op;
    const auto bits = c.read<uint8_t>();
    op.is_explicit = (bits & 1) != 0;
    if (bits & 2) items_.items(c, op.explicit_items);
    if (bits & 4) items_.items(c, op.added);
    if (bits & 32) items_.items(c, op.prepended);
    if (bits & 64) items_.items(c, op.appended);
    if (bits & 8) items_.items(c, op.deleted);
    if (bits & 16) items_.items(c, op.ordered);
    if (!c.ok()) return context_.fail(c);
    // A list is either explicit or edits
    if (op.is_explicit || (bits & 2))
        op = layer::ListOp<T>::make_explicit(std::move(op.explicit_items));
    out = Value(std::move(op));
    return true;
}

template <class T>
bool FieldReader::read_vector(Cursor& c, Value& out) {
    std::vector<T> elements;
    items_.items(c, elements);
    if (!c.ok()) return context_.fail(c);
    if constexpr (layer::ValueElement<std::vector<T>>) {
        out = Value(std::move(elements));
    } else {
        out = Value::array<T>(std::move(elements));
    }
    return true;
}

bool FieldReader::read_unregistered(Cursor& c, Value& out) {
    Value value;
    items_.item(c, value);
    if (!c.ok()) return context_.fail(c);
    if (const auto* text = value.get_if<std::string>()) {
        out = Value(layer::UnregisteredValue{*text});
        return true;
    }
    if (value.holds<layer::Dictionary>() ||
        value.holds<layer::ListOp<layer::UnregisteredValue>>()) {
        out = std::move(value);
        return true;
    }
    return context_.fail(c.at(),
                         "found an unregistered value of another type, expected text, a dictionary "
                         "or a list of edits");
}

bool FieldReader::read_times(ValueRep rep, std::vector<double>& out) {
    Value value;
    if (!values_.read(rep, value)) return false;
    if (!value.holds_array<double>()) {
        return context_.fail(rep.payload(),
                             "found another type for the times of samples, expected doubles");
    }
    const auto times = value.as_array<double>();
    out.assign(times.begin(), times.end());
    return true;
}

bool FieldReader::read_time_samples(Cursor& c, Value& out) {
    // Samples within samples could hold themselves
    if (context_.depth > 1 || context_.is_sample) {
        return context_.fail(c.at(), "found time samples within a value, expected them in a field");
    }
    c.follow();
    const uint64_t times_at = c.at();
    const ValueRep times_rep{c.read<uint64_t>()};
    c.follow();
    const uint64_t n = c.count(sizeof(ValueRep));
    const uint64_t values_at = c.at();
    if (!c.ok()) return context_.fail(c);
    std::vector<double> times;
    if (!read_times(times_rep, times)) return false;
    if (times.size() != n) {
        return context_.fail(
            times_at,
            fmt::format("found {} times for {} samples, expected as many", times.size(), n));
    }
    if (std::any_of(times.begin(), times.end(), [](double t) { return t != t; })) {
        return context_.fail(times_at, "found a sample with an invalid time, expected a number");
    }
    out = Value(make_time_samples(context_.file, std::move(times), values_at));
    return true;
}

bool FieldReader::read_spline(Cursor& c, Value& out) {
    const uint64_t at = c.at();
    const std::string_view blob = c.take(c.read<uint64_t>());
    const uint64_t n = context_.count(c, 16, 64);
    std::vector<std::pair<double, layer::Dictionary>> custom_data(n);
    for (auto& [time, data] : custom_data) {
        items_.item(c, time);
        items_.item(c, data);
    }
    if (!c.ok()) return context_.fail(c);
    layer::SplineValue spline;
    if (!context_.spend(c, blob.size() * 8)) return context_.fail(c);
    Problem problem;
    if (!decode_spline(blob, std::move(custom_data), spline, problem)) {
        return context_.fail(at + sizeof(uint64_t) + problem.at, problem.message);
    }
    out = Value(std::move(spline));
    return true;
}

bool FieldReader::read(ValueRep rep, Value& out) {
    Cursor c(context_.file->bytes(), rep.payload());
    const auto whole = [&](auto value) {
        items_.item(c, value);
        if (!c.ok()) return context_.fail(c);
        out = Value(std::move(value));
        return true;
    };
    const auto pairs = [&](auto value) {
        items_.items(c, value);
        if (!c.ok()) return context_.fail(c);
        out = Value(std::move(value));
        return true;
    };
    switch (rep.type()) {
        case TypeId::Dictionary:
            return whole(layer::Dictionary());
        case TypeId::TokenListOp:
            return read_list_op<layer::Token>(c, out);
        case TypeId::StringListOp:
            return read_list_op<std::string>(c, out);
        case TypeId::PathListOp:
            return read_list_op<layer::Path>(c, out);
        case TypeId::ReferenceListOp:
            return read_list_op<layer::Reference>(c, out);
        case TypeId::PayloadListOp:
            return read_list_op<layer::Payload>(c, out);
        case TypeId::IntListOp:
            return read_list_op<int32_t>(c, out);
        case TypeId::Int64ListOp:
            return read_list_op<int64_t>(c, out);
        case TypeId::UIntListOp:
            return read_list_op<uint32_t>(c, out);
        case TypeId::UInt64ListOp:
            return read_list_op<uint64_t>(c, out);
        case TypeId::UnregisteredValueListOp:
            return read_list_op<layer::UnregisteredValue>(c, out);
        case TypeId::TokenVector:
            return read_vector<layer::Token>(c, out);
        case TypeId::DoubleVector:
            return read_vector<double>(c, out);
        case TypeId::StringVector:
            return read_vector<std::string>(c, out);
        case TypeId::LayerOffsetVector:
            return read_vector<layer::LayerOffset>(c, out);
        case TypeId::VariantSelectionMap:
            return pairs(layer::VariantSelections());
        case TypeId::Relocates:
            return pairs(layer::Relocates());
        case TypeId::Payload:
            return whole(layer::Payload());
        case TypeId::TimeSamples:
            return read_time_samples(c, out);
        case TypeId::UnregisteredValue:
            return read_unregistered(c, out);
        case TypeId::Spline:
            return read_spline(c, out);
        case TypeId::Value:
            items_.item(c, out);
            return c.ok() || context_.fail(c);
        default:
            return context_.fail(rep.payload(),
                                 fmt::format("found a value of type {}, expected a type that "
                                             "is known to the layer",
                                             int(rep.type())));
    }
}

}  // namespace velatura::usd::crate
