// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace velatura::usd::crate {

inline constexpr std::string_view crate_magic = "PXR-USDC";
/// Identifier, version, offset of the table of contents, reserve. The standard's table (16.3.8.3)
/// gives the reserve 8 bytes; files have 64.
inline constexpr size_t bootstrap_size = 88;
/// Arrays of fewer elements are stored plain even where their flag says compressed.
inline constexpr size_t min_compressed_array = 16;

struct Version {
    uint8_t major_number = 0;
    uint8_t minor_number = 0;
    uint8_t patch_number = 0;

    auto operator<=>(const Version&) const = default;
};

/// Newest version that is read. 0.13 adds tangent algorithms of splines, 0.14 edits of arrays.
inline constexpr Version newest_version{0, 14, 0};

/// Types of values by their number in files. Ref: AOUSD Core Specification 1.0.1, 16.3.10.1;
/// number 60 from OpenUSD.
enum class TypeId : uint8_t {
    Invalid = 0,
    Bool = 1,
    UChar = 2,
    Int = 3,
    UInt = 4,
    Int64 = 5,
    UInt64 = 6,
    Half = 7,
    Float = 8,
    Double = 9,
    String = 10,
    Token = 11,
    Asset = 12,
    Matrix2d = 13,
    Matrix3d = 14,
    Matrix4d = 15,
    Quatd = 16,
    Quatf = 17,
    Quath = 18,
    Double2 = 19,
    Float2 = 20,
    Half2 = 21,
    Int2 = 22,
    Double3 = 23,
    Float3 = 24,
    Half3 = 25,
    Int3 = 26,
    Double4 = 27,
    Float4 = 28,
    Half4 = 29,
    Int4 = 30,
    Dictionary = 31,
    TokenListOp = 32,
    StringListOp = 33,
    PathListOp = 34,
    ReferenceListOp = 35,
    IntListOp = 36,
    Int64ListOp = 37,
    UIntListOp = 38,
    UInt64ListOp = 39,
    PathVector = 40,
    TokenVector = 41,
    Specifier = 42,
    Permission = 43,
    Variability = 44,
    VariantSelectionMap = 45,
    TimeSamples = 46,
    Payload = 47,
    DoubleVector = 48,
    LayerOffsetVector = 49,
    StringVector = 50,
    ValueBlock = 51,
    Value = 52,
    UnregisteredValue = 53,
    UnregisteredValueListOp = 54,
    PayloadListOp = 55,
    TimeCode = 56,
    PathExpression = 57,
    Relocates = 58,
    Spline = 59,
    AnimationBlock = 60,
};

/// Where a value is and what it is: payload of 48 bits (an offset in the file, or the value
/// itself), type, flags.
struct ValueRep {
    static constexpr uint64_t array_bit = uint64_t(1) << 63;
    static constexpr uint64_t inlined_bit = uint64_t(1) << 62;
    static constexpr uint64_t compressed_bit = uint64_t(1) << 61;
    static constexpr uint64_t array_edit_bit = uint64_t(1) << 60;
    static constexpr uint64_t payload_mask = (uint64_t(1) << 48) - 1;

    uint64_t bits = 0;

    bool operator==(const ValueRep&) const = default;

    TypeId type() const { return TypeId((bits >> 48) & 0xff); }

    bool is_array() const { return (bits & array_bit) != 0; }

    bool is_inlined() const { return (bits & inlined_bit) != 0; }

    bool is_compressed() const { return (bits & compressed_bit) != 0; }

    bool is_array_edit() const { return (bits & array_edit_bit) != 0; }

    uint64_t payload() const { return bits & payload_mask; }

    /// The 32 bits of an inlined value.
    uint32_t inlined() const { return uint32_t(bits); }

    static ValueRep make(TypeId type, uint64_t payload, uint64_t flags = 0) {
        return {(payload & payload_mask) | uint64_t(type) << 48 | flags};
    }
};

/// Kinds of specs by their number in files.
enum class SpecForm : uint32_t {
    Unknown = 0,
    Attribute = 1,
    Connection = 2,
    Expression = 3,
    Mapper = 4,
    MapperArgument = 5,
    Prim = 6,
    PseudoRoot = 7,
    Relationship = 8,
    RelationshipTarget = 9,
    Variant = 10,
    VariantSet = 11,
};

/// Ends a run of fields in the table of field sets.
inline constexpr uint32_t field_set_end = 0xffffffff;

}  // namespace velatura::usd::crate
