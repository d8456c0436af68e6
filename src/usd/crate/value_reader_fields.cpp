// SPDX-License-Identifier: Apache-2.0
// Values of fields that lie at an offset: dictionaries, list ops, arcs, time samples. Ref: AOUSD
// Core Specification 1.0.1, 16.3.10; what follows a value within a value, from OpenUSD.
#include "usd/crate/spline_bytes.h"
#include "usd/crate/stored.h"
#include "usd/crate/time_samples.h"
#include "usd/crate/value_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::usd::crate {

using layer::Value;

namespace {

/// Bytes of a T in a file, at least.
template <class T>
constexpr uint64_t least_stored() {
    if constexpr (std::is_same_v<T, layer::Reference>) return 32;
    if constexpr (std::is_same_v<T, layer::Payload>) return 8;
    if constexpr (std::is_same_v<T, layer::LayerOffset>) return 16;
    // Values begin with an offset, names and paths are indices
    if constexpr (std::is_same_v<T, layer::UnregisteredValue>) return 8;
    if constexpr (std::is_arithmetic_v<T>) return sizeof(T);
    return 4;
}

}  // namespace

bool ValueReader::spend(Cursor& c, uint64_t bytes) {
    if (bytes <= bytes_left_) {
        bytes_left_ -= bytes;
        return true;
    }
    bytes_left_ = 0;
    return c.fail("more values than the file's size allows", "fewer, limit reached");
}

uint64_t ValueReader::count(Cursor& c, uint64_t stored_bytes, uint64_t bytes) {
    const uint64_t n = c.count(stored_bytes);
    return spend(c, n * bytes) ? n : 0;
}

void ValueReader::item(Cursor& c, int32_t& out) {
    out = c.read<int32_t>();
}

void ValueReader::item(Cursor& c, uint32_t& out) {
    out = c.read<uint32_t>();
}

void ValueReader::item(Cursor& c, int64_t& out) {
    out = c.read<int64_t>();
}

void ValueReader::item(Cursor& c, uint64_t& out) {
    out = c.read<uint64_t>();
}

void ValueReader::item(Cursor& c, double& out) {
    out = c.read<double>();
}

void ValueReader::item(Cursor& c, std::string& out) {
    const uint64_t at = c.at();
    const auto index = c.read<uint32_t>();
    uint64_t copied = 0;
    if (!c.ok()) return;
    if (!load_text(*file_, index, out, copied)) {
        c.fail_at(at, fmt::format("string {}", index),
                  fmt::format("one of {}", file_->strings.size()));
    }
    spend(c, copied);
}

void ValueReader::item(Cursor& c, layer::Token& out) {
    const uint64_t at = c.at();
    const auto index = c.read<uint32_t>();
    uint64_t copied = 0;
    if (c.ok() && !load_text(*file_, index, out, copied)) {
        c.fail_at(at, fmt::format("token {}", index),
                  fmt::format("one of {}", file_->tokens.size()));
    }
}

void ValueReader::item(Cursor& c, layer::Path& out) {
    const uint64_t at = c.at();
    const auto index = c.read<uint32_t>();
    if (!c.ok()) return;
    if (index >= file_->paths.size()) {
        c.fail_at(at, fmt::format("path {}", index), fmt::format("one of {}", file_->paths.size()));
        return;
    }
    out = file_->paths[index];
}

void ValueReader::item(Cursor& c, layer::LayerOffset& out) {
    out.offset = c.read<double>();
    out.scale = c.read<double>();
}

void ValueReader::item(Cursor& c, layer::Reference& out) {
    item(c, out.asset);
    item(c, out.prim_path);
    item(c, out.offset);
    item(c, out.custom_data);
}

void ValueReader::item(Cursor& c, layer::Payload& out) {
    item(c, out.asset);
    item(c, out.prim_path);
    if (file_->version >= Version{0, 8, 0}) item(c, out.offset);
}

void ValueReader::item(Cursor& c, layer::UnregisteredValue& out) {
    Value value;
    item(c, value);
    if (const auto* text = value.get_if<std::string>()) {
        out.text = *text;
    } else if (c.ok()) {
        c.fail("an item of another type in a list of unregistered values", "text");
    }
}

void ValueReader::item(Cursor& c, Value& out) {
    // What is stored with the value lies between the offset and the ValueRep, after which the
    // surrounding value goes on
    const uint64_t at = c.at();
    if (!c.follow()) return;
    const ValueRep rep{c.read<uint64_t>()};
    if (!c.ok()) return;
    if (!spend(c, sizeof(Value))) return;
    if (!read(rep, out)) c.fail(problem_.at != 0 ? problem_ : Problem{at, problem_.message});
}

void ValueReader::item(Cursor& c, layer::Dictionary& out) {
    if (depth_ >= max_value_depth) {
        c.fail(fmt::format("more than {} levels of values", max_value_depth), "fewer");
        return;
    }
    ++depth_;
    const uint64_t n = count(c, 12, 64);
    for (uint64_t i = 0; i < n && c.ok(); ++i) {
        std::string key;
        item(c, key);
        Value value;
        item(c, value);
        if (c.ok()) out.entries[std::move(key)] = std::move(value);
    }
    --depth_;
}

template <class A, class B>
void ValueReader::item(Cursor& c, std::pair<A, B>& out) {
    item(c, out.first);
    item(c, out.second);
}

template <class T>
void ValueReader::items(Cursor& c, std::vector<T>& out) {
    const uint64_t n = count(c, least_stored<T>(), sizeof(T));
    out.reserve(n);
    for (uint64_t i = 0; i < n && c.ok(); ++i) {
        T value{};
        item(c, value);
        out.push_back(std::move(value));
    }
}

template <class T>
bool ValueReader::read_list_op(Cursor& c, Value& out) {
    layer::ListOp<T> op;
    const auto bits = c.read<uint8_t>();
    op.is_explicit = (bits & 1) != 0;
    if (bits & 2) items(c, op.explicit_items);
    if (bits & 4) items(c, op.added);
    if (bits & 32) items(c, op.prepended);
    if (bits & 64) items(c, op.appended);
    if (bits & 8) items(c, op.deleted);
    if (bits & 16) items(c, op.ordered);
    if (!c.ok()) return fail(c);
    // A list is either explicit or edits
    if (op.is_explicit || (bits & 2))
        op = layer::ListOp<T>::make_explicit(std::move(op.explicit_items));
    out = Value(std::move(op));
    return true;
}

template <class T>
bool ValueReader::read_vector(Cursor& c, Value& out) {
    std::vector<T> elements;
    items(c, elements);
    if (!c.ok()) return fail(c);
    if constexpr (layer::ValueElement<std::vector<T>>) {
        out = Value(std::move(elements));
    } else {
        out = Value::array<T>(std::move(elements));
    }
    return true;
}

bool ValueReader::read_unregistered(Cursor& c, Value& out) {
    Value value;
    item(c, value);
    if (!c.ok()) return fail(c);
    if (const auto* text = value.get_if<std::string>()) {
        out = Value(layer::UnregisteredValue{*text});
        return true;
    }
    if (value.holds<layer::Dictionary>() ||
        value.holds<layer::ListOp<layer::UnregisteredValue>>()) {
        out = std::move(value);
        return true;
    }
    return fail(c.at(),
                "found an unregistered value of another type, expected text, a dictionary "
                "or a list of edits");
}

bool ValueReader::read_times(ValueRep rep, std::vector<double>& out) {
    Value value;
    if (!read(rep, value)) return false;
    if (!value.holds_array<double>()) {
        return fail(rep.payload(), "found another type for the times of samples, expected doubles");
    }
    const auto times = value.as_array<double>();
    out.assign(times.begin(), times.end());
    return true;
}

bool ValueReader::read_time_samples(Cursor& c, Value& out) {
    // Samples within samples could hold themselves
    if (depth_ > 1 || is_sample_) {
        return fail(c.at(), "found time samples within a value, expected them in a field");
    }
    c.follow();
    const uint64_t times_at = c.at();
    const ValueRep times_rep{c.read<uint64_t>()};
    c.follow();
    const uint64_t n = c.count(sizeof(ValueRep));
    const uint64_t values_at = c.at();
    if (!c.ok()) return fail(c);
    std::vector<double> times;
    if (!read_times(times_rep, times)) return false;
    if (times.size() != n) {
        return fail(times_at, fmt::format("found {} times for {} samples, expected as many",
                                          times.size(), n));
    }
    if (std::any_of(times.begin(), times.end(), [](double t) { return t != t; })) {
        return fail(times_at, "found a sample at no time, expected a number");
    }
    out = Value(make_time_samples(file_, std::move(times), values_at));
    return true;
}

bool ValueReader::read_spline(Cursor& c, Value& out) {
    const uint64_t at = c.at();
    const std::string_view blob = c.take(c.read<uint64_t>());
    const uint64_t n = count(c, 16, 64);
    std::vector<std::pair<double, layer::Dictionary>> custom_data(n);
    for (auto& [time, data] : custom_data) {
        item(c, time);
        item(c, data);
    }
    if (!c.ok()) return fail(c);
    layer::SplineValue spline;
    if (!spend(c, blob.size() * 8)) return fail(c);
    Problem problem;
    if (!decode_spline(blob, std::move(custom_data), spline, problem)) {
        return fail(at + sizeof(uint64_t) + problem.at, problem.message);
    }
    out = Value(std::move(spline));
    return true;
}

bool ValueReader::read_stored(ValueRep rep, Value& out) {
    Cursor c(file_->bytes(), rep.payload());
    const auto whole = [&](auto value) {
        item(c, value);
        if (!c.ok()) return fail(c);
        out = Value(std::move(value));
        return true;
    };
    const auto pairs = [&](auto value) {
        items(c, value);
        if (!c.ok()) return fail(c);
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
            item(c, out);
            return c.ok() || fail(c);
        default:
            return fail(rep.payload(), fmt::format("found a value of type {}, expected a type that "
                                                   "is known to the layer",
                                                   int(rep.type())));
    }
}

}  // namespace velatura::usd::crate
