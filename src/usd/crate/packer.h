// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/crate_format.h"
#include "usd/layer/layer.h"
#include "usd/layer/value.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::usd::crate {

/// Gathers the tables of a file and the bytes of its values. Equal values are stored once. What a
/// value refers to is stored before it, so that a value's bytes are the same wherever they lie.
class Packer {
  public:
    explicit Packer(Version version);

    /// The ValueRep of a value; false when the format has no type for it.
    bool pack(const layer::Value& value, ValueRep& out);
    /// Arrays in the form that fields of lists have: tokens, strings.
    bool pack_vector(const layer::Value& value, ValueRep& out);
    ValueRep pack_names(std::span<const layer::Token> names);

    uint32_t token(layer::Token token);
    uint32_t string(const std::string& text);
    uint32_t path(layer::Path path);

    /// Bytes so far: room for the header, then values.
    std::string& out() { return out_; }

    const std::vector<layer::Token>& tokens() const { return tokens_; }

    const std::vector<uint32_t>& strings() const { return strings_; }

    const std::vector<layer::Path>& paths() const { return paths_; }

    /// Index of a path that is there already.
    uint32_t path_index(layer::Path path) const { return path_indices_.at(path); }

    /// Some text has a zero byte, which would end it in the file.
    bool has_zero_byte() const { return has_zero_byte_; }

    /// The version that what was packed needs.
    Version needed() const { return needed_; }

  private:
    struct Stored {
        uint64_t at;
        uint64_t size;
        ValueRep rep;
    };

    void need(Version version) { needed_ = std::max(needed_, version); }

    ValueRep store(TypeId type,
                   std::string_view bytes,
                   uint64_t flags = 0,
                   bool is_aligned = false);
    template <class T>
    bool pack_scalar(const T& value, ValueRep& out);
    template <class T>
    bool pack_array(std::span<const T> elements, ValueRep& out);
    template <class T>
    bool compress_array(std::span<const T> elements, std::string& bytes) const;
    template <class T>
    ValueRep pack_list_op(TypeId type, const layer::ListOp<T>& op);
    bool pack_field_type(const layer::Value& value, ValueRep& out);
    bool pack_payloads(const layer::PayloadListOp& op, ValueRep& out);
    bool pack_samples(const layer::TimeSamples& samples, ValueRep& out);
    bool pack_spline(const layer::SplineValue& spline, ValueRep& out);

    // Appends items of lists and maps
    template <class T>
    void item(std::string& bytes, const T& number);
    void item(std::string& bytes, const std::string& text);
    void item(std::string& bytes, const layer::Token& text);
    void item(std::string& bytes, const layer::Path& p);
    void item(std::string& bytes, const layer::LayerOffset& offset);
    void item(std::string& bytes, const layer::Reference& reference);
    void item(std::string& bytes, const layer::Payload& payload);
    void item(std::string& bytes, const layer::UnregisteredValue& value);
    void item(std::string& bytes, const layer::Dictionary& dictionary);
    template <class A, class B>
    void item(std::string& bytes, const std::pair<A, B>& pair);
    template <class T>
    void items(std::string& bytes, const std::vector<T>& list);

    Version version_;
    Version needed_;
    bool has_zero_byte_ = false;
    std::string out_;
    std::vector<layer::Token> tokens_;
    std::vector<uint32_t> strings_;
    std::vector<layer::Path> paths_;
    std::unordered_map<layer::Token, uint32_t> token_indices_;
    std::unordered_map<layer::Token, uint32_t> string_indices_;
    std::unordered_map<layer::Path, uint32_t> path_indices_;
    std::unordered_multimap<size_t, Stored> stored_;
};

}  // namespace velatura::usd::crate
