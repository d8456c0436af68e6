// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/packer.h"

#include "usd/crate/append.h"
#include "usd/crate/spline_bytes.h"

#include <algorithm>

namespace velatura::usd::crate {

using layer::Token;
using layer::Value;
using layer::ValueType;

Packer::Packer(Version version) : version_(version), needed_(version), out_(bootstrap_size, '\0') {
    // Nothing may refer to the first token, whose index has no sign
    tokens_.emplace_back("_");
}

uint32_t Packer::token(Token token) {
    const auto [it, is_new] = token_indices_.emplace(token, uint32_t(tokens_.size()));
    if (is_new) {
        tokens_.push_back(token);
        has_zero_byte_ = has_zero_byte_ || token.str().find('\0') != std::string::npos;
    }
    return it->second;
}

uint32_t Packer::string(const std::string& text) {
    const Token token_of_text{text};
    const auto [it, is_new] = string_indices_.emplace(token_of_text, uint32_t(strings_.size()));
    if (is_new) strings_.push_back(token(token_of_text));
    return it->second;
}

uint32_t Packer::path(layer::Path p) {
    // Parents first, by steps, as paths may be deep
    std::vector<layer::Path> missing;
    for (; path_indices_.find(p) == path_indices_.end(); p = p.parent()) {
        missing.push_back(p);
        // The table is a tree from "/"; other paths have an index and no place
        if (!p.is_absolute() || p.is_absolute_root()) break;
    }
    uint32_t index = missing.empty() ? path_indices_.at(p) : 0;
    for (auto it = missing.rbegin(); it != missing.rend(); ++it) {
        index = uint32_t(paths_.size());
        path_indices_.emplace(*it, index);
        paths_.push_back(*it);
    }
    return index;
}

ValueRep Packer::store(TypeId type, std::string_view bytes, uint64_t flags, bool is_aligned) {
    const size_t hash = std::hash<std::string_view>()(bytes) ^ (size_t(type) << 8) ^ flags;
    const auto [first, last] = stored_.equal_range(hash);
    for (auto it = first; it != last; ++it) {
        const Stored& s = it->second;
        const bool is_same_kind = s.rep.type() == type && (s.rep.bits & ~ValueRep::payload_mask) ==
                                                              ValueRep::make(type, 0, flags).bits;
        if (is_same_kind && std::string_view(out_).substr(s.at, s.size) == bytes) return s.rep;
    }
    if (is_aligned) out_.resize((out_.size() + 7) / 8 * 8);
    const ValueRep rep = ValueRep::make(type, out_.size(), flags);
    stored_.emplace(hash, Stored{out_.size(), bytes.size(), rep});
    out_ += bytes;
    return rep;
}

template <class T>
void Packer::item(std::string& bytes, const T& number) {
    static_assert(std::is_arithmetic_v<T>);
    append(bytes, number);
}

void Packer::item(std::string& bytes, const std::string& text) {
    append(bytes, string(text));
}

void Packer::item(std::string& bytes, const Token& text) {
    append(bytes, token(text));
}

void Packer::item(std::string& bytes, const layer::Path& p) {
    append(bytes, path(p));
}

void Packer::item(std::string& bytes, const layer::LayerOffset& offset) {
    append(bytes, offset.offset);
    append(bytes, offset.scale);
}

void Packer::item(std::string& bytes, const layer::Reference& reference) {
    item(bytes, reference.asset);
    item(bytes, reference.prim_path);
    item(bytes, reference.offset);
    item(bytes, reference.custom_data);
}

void Packer::item(std::string& bytes, const layer::Payload& payload) {
    item(bytes, payload.asset);
    item(bytes, payload.prim_path);
    if (version_ >= Version{0, 8, 0}) {
        item(bytes, payload.offset);
    } else if (!payload.offset.is_identity()) {
        need({0, 8, 0});
    }
}

void Packer::item(std::string& bytes, const layer::UnregisteredValue& value) {
    const ValueRep rep = ValueRep::make(TypeId::String, string(value.text), ValueRep::inlined_bit);
    // The value follows its offset at once
    append(bytes, int64_t(sizeof(int64_t)));
    append(bytes, rep.bits);
}

void Packer::item(std::string& bytes, const layer::Dictionary& dictionary) {
    std::string entries;
    uint64_t count = 0;
    for (const auto& [key, value] : dictionary.entries) {
        ValueRep rep;
        if (!pack(value, rep)) continue;
        item(entries, key);
        append(entries, int64_t(sizeof(int64_t)));
        append(entries, rep.bits);
        ++count;
    }
    append(bytes, count);
    bytes += entries;
}

template <class A, class B>
void Packer::item(std::string& bytes, const std::pair<A, B>& pair) {
    item(bytes, pair.first);
    item(bytes, pair.second);
}

template <class T>
void Packer::items(std::string& bytes, const std::vector<T>& list) {
    append(bytes, uint64_t(list.size()));
    for (const T& element : list) item(bytes, element);
}

template <class T>
ValueRep Packer::pack_list_op(TypeId type, const layer::ListOp<T>& op) {
    const auto bit = [](const std::vector<T>& list, unsigned b) { return list.empty() ? 0u : b; };
    std::string bytes;
    bytes += char((op.is_explicit ? 1u : 0u) | bit(op.explicit_items, 2) | bit(op.added, 4) |
                  bit(op.deleted, 8) | bit(op.ordered, 16) | bit(op.prepended, 32) |
                  bit(op.appended, 64));
    for (const auto* list :
         {&op.explicit_items, &op.added, &op.prepended, &op.appended, &op.deleted, &op.ordered}) {
        if (!list->empty()) items(bytes, *list);
    }
    return store(type, bytes);
}

bool Packer::pack_samples(const layer::TimeSamples& samples, ValueRep& out) {
    std::vector<double> times;
    std::string values;
    for (size_t i = 0; i < samples.size(); ++i) {
        ValueRep rep;
        if (!pack(samples.value(i), rep)) continue;
        times.push_back(samples.times()[i]);
        append(values, rep.bits);
    }
    std::string bytes;
    items(bytes, times);
    const ValueRep times_rep = store(TypeId::DoubleVector, bytes);
    bytes.clear();
    append(bytes, int64_t(sizeof(int64_t)));
    append(bytes, times_rep.bits);
    append(bytes, int64_t(sizeof(int64_t)));
    append(bytes, uint64_t(times.size()));
    bytes += values;
    out = store(TypeId::TimeSamples, bytes);
    return times.size() == samples.size();
}

bool Packer::pack_spline(const layer::SplineValue& spline, ValueRep& out) {
    need(has_tangent_algorithms(spline) ? Version{0, 13, 0} : Version{0, 12, 0});
    const std::string blob = encode_spline(spline);
    std::string bytes;
    append(bytes, uint64_t(blob.size()));
    bytes += blob;
    std::string custom_data;
    uint64_t count = 0;
    for (const layer::SplineKnot& k : spline.knots) {
        if (k.custom_data.empty()) continue;
        append(custom_data, k.time);
        item(custom_data, k.custom_data);
        ++count;
    }
    append(bytes, count);
    bytes += custom_data;
    out = store(TypeId::Spline, bytes);
    return true;
}

ValueRep Packer::pack_names(std::span<const Token> names) {
    std::string bytes;
    items(bytes, std::vector<Token>(names.begin(), names.end()));
    return store(TypeId::TokenVector, bytes);
}

bool Packer::pack_vector(const Value& value, ValueRep& out) {
    if (value.holds_array<Token>()) {
        out = pack_names(value.as_array<Token>());
        return true;
    }
    if (!value.holds_array<std::string>()) return pack(value, out);
    const auto texts = value.as_array<std::string>();
    std::string bytes;
    items(bytes, std::vector<std::string>(texts.begin(), texts.end()));
    out = store(TypeId::StringVector, bytes);
    return true;
}

bool Packer::pack_payloads(const layer::PayloadListOp& op, ValueRep& out) {
    // Before 0.8 there is one payload or the statement of none
    if (version_ < Version{0, 8, 0} && op.is_explicit && op.explicit_items.size() <= 1) {
        std::string bytes;
        item(bytes, op.explicit_items.empty() ? layer::Payload() : op.explicit_items[0]);
        out = store(TypeId::Payload, bytes);
        return true;
    }
    need({0, 8, 0});
    out = pack_list_op(TypeId::PayloadListOp, op);
    return true;
}

bool Packer::pack_field_type(const Value& value, ValueRep& out) {
    const auto whole = [&](TypeId type, const auto& content) {
        std::string bytes;
        item(bytes, content);
        out = store(type, bytes);
        return true;
    };
    const auto list = [&](TypeId type, const auto& content) {
        std::string bytes;
        items(bytes, content);
        out = store(type, bytes);
        return true;
    };
    const auto list_op = [&]<class T>(TypeId type, const layer::ListOp<T>& op) {
        out = pack_list_op(type, op);
        return true;
    };
    const auto number = [&](TypeId type, auto e) {
        out = ValueRep::make(type, uint32_t(e), ValueRep::inlined_bit);
        return true;
    };
    switch (value.type()) {
        case ValueType::Block:
            return number(TypeId::ValueBlock, 0);
        case ValueType::AnimationBlock:
            return number(TypeId::AnimationBlock, 0);
        case ValueType::Specifier:
            return number(TypeId::Specifier, *value.get_if<layer::Specifier>());
        case ValueType::Permission:
            return number(TypeId::Permission, *value.get_if<layer::Permission>());
        case ValueType::Variability:
            return number(TypeId::Variability, *value.get_if<layer::Variability>());
        case ValueType::Dictionary:
            if (value.get_if<layer::Dictionary>()->empty()) return number(TypeId::Dictionary, 0);
            return whole(TypeId::Dictionary, *value.get_if<layer::Dictionary>());
        case ValueType::TokenListOp:
            return list_op(TypeId::TokenListOp, *value.get_if<layer::TokenListOp>());
        case ValueType::StringListOp:
            return list_op(TypeId::StringListOp, *value.get_if<layer::StringListOp>());
        case ValueType::PathListOp:
            return list_op(TypeId::PathListOp, *value.get_if<layer::PathListOp>());
        case ValueType::ReferenceListOp:
            return list_op(TypeId::ReferenceListOp, *value.get_if<layer::ReferenceListOp>());
        case ValueType::PayloadListOp:
            return pack_payloads(*value.get_if<layer::PayloadListOp>(), out);
        case ValueType::IntListOp:
            return list_op(TypeId::IntListOp, *value.get_if<layer::ListOp<int32_t>>());
        case ValueType::UIntListOp:
            return list_op(TypeId::UIntListOp, *value.get_if<layer::ListOp<uint32_t>>());
        case ValueType::Int64ListOp:
            return list_op(TypeId::Int64ListOp, *value.get_if<layer::ListOp<int64_t>>());
        case ValueType::UInt64ListOp:
            return list_op(TypeId::UInt64ListOp, *value.get_if<layer::ListOp<uint64_t>>());
        case ValueType::UnregisteredListOp:
            return list_op(TypeId::UnregisteredValueListOp,
                           *value.get_if<layer::ListOp<layer::UnregisteredValue>>());
        case ValueType::Unregistered:
            return whole(TypeId::UnregisteredValue, *value.get_if<layer::UnregisteredValue>());
        case ValueType::LayerOffsets:
            return list(TypeId::LayerOffsetVector,
                        *value.get_if<std::vector<layer::LayerOffset>>());
        case ValueType::SelectionMap:
            return list(TypeId::VariantSelectionMap, *value.get_if<layer::VariantSelections>());
        case ValueType::RelocateMap:
            need({0, 11, 0});
            return list(TypeId::Relocates, *value.get_if<layer::Relocates>());
        case ValueType::Payload:
            return whole(TypeId::Payload, *value.get_if<layer::Payload>());
        case ValueType::TimeSamples:
            return pack_samples(*value.get_if<layer::TimeSamples>(), out);
        case ValueType::Spline:
            return pack_spline(*value.get_if<layer::SplineValue>(), out);
        default:
            return false;
    }
}

}  // namespace velatura::usd::crate
