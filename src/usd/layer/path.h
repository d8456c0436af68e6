// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "usd/layer/token.h"

#include <compare>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::layer {

/// What the last element of a path is.
enum class PathKind : uint8_t {
    Empty,
    AbsoluteRoot,         ///< "/"
    RelativeRoot,         ///< "."
    Parent,               ///< ".."; only at the front of relative paths
    Prim,                 ///< "/A", "A"
    VariantSelection,     ///< "/A{set=sel}"; "{set=}" names the variant set itself
    Property,             ///< "/A.b:c"
    Target,               ///< "/A.b[/T]"
    RelationalAttribute,  ///< "/A.b[/T].c"
    Mapper,               ///< "/A.b.mapper[/T]"
    MapperArgument,       ///< "/A.b.mapper[/T].c"
    Expression,           ///< "/A.b.expression"
};

/// An interned address of an object in a layer or stage: pointer-sized, compared and hashed by
/// address, thread-safe. Ref: AOUSD Core Specification 1.0.1, chapter 8 (paths).
class Path {
  public:
    /// The empty path: addresses nothing.
    Path() = default;

    static Path absolute_root();
    static Path relative_root();

    /// Nesting of elements that parse() and the append functions accept; deeper gives an Error or
    /// an empty path.
    static constexpr size_t max_elements = 4096;

    /// Reads "/World/Cam{look=red}Body.primvars:st[/Other].x", "../A", ".b" and so on. Error
    /// "usd-path" says where.
    static Result<Path> parse(std::string_view text);

    /// The same for text known to be good; an empty path when it is not.
    static Path from(std::string_view text);

    PathKind kind() const;

    bool is_empty() const { return node_ == nullptr; }

    explicit operator bool() const { return node_ != nullptr; }

    bool is_absolute() const;

    bool is_absolute_root() const { return kind() == PathKind::AbsoluteRoot; }

    bool is_prim() const { return kind() == PathKind::Prim; }

    bool is_root_prim() const;  ///< prim whose parent is "/"

    bool is_prim_or_variant() const { return is_prim() || is_variant_selection(); }

    bool is_variant_selection() const { return kind() == PathKind::VariantSelection; }

    bool is_property() const {
        return kind() == PathKind::Property || kind() == PathKind::RelationalAttribute;
    }

    bool is_target() const { return kind() == PathKind::Target; }

    bool has_variant_selection() const;  ///< anywhere in the path
    bool has_target() const;             ///< some element is a target, mapper or below one
    size_t element_count() const;        ///< 0 for "/", "." and the empty path

    /// Path without its last element; of "." it is "..", of "/" the empty path.
    Path parent() const;
    /// Name of the last prim, property, relational attribute or mapper argument; the variant set of
    /// a selection.
    Token name() const;
    Token variant_set() const;  ///< of a VariantSelection element, else empty
    Token variant() const;      ///< of a VariantSelection element, else empty
    Path target() const;        ///< of a Target or Mapper element, else empty
    /// Nearest prim: without property parts and trailing variant selections; "/" or "." stay.
    Path prim_path() const;

    Path append_child(Token prim_name) const;

    Path append_child(std::string_view prim_name) const { return append_child(Token(prim_name)); }

    Path append_property(Token property_name) const;

    Path append_property(std::string_view n) const { return append_property(Token(n)); }

    Path append_variant_selection(Token set, Token variant) const;
    Path append_target(Path target) const;
    Path append_relational_attribute(Token name) const;
    Path append_mapper(Path target) const;
    Path append_mapper_argument(Token name) const;
    Path append_expression() const;

    /// This path is `prefix` or lies below it (targets are not looked into).
    bool has_prefix(Path prefix) const;
    /// Swaps the leading `old_prefix` for `new_prefix`, also inside target paths when fix_targets.
    Path replace_prefix(Path old_prefix, Path new_prefix, bool fix_targets = true) const;
    /// Resolves a relative path, its targets too, against an absolute prim path; empty when ".."
    /// leaves the root.
    Path make_absolute(Path anchor) const;
    Path strip_variant_selections() const;
    /// Every prefix from the root element to the path itself ("/A", "/A/B", "/A/B.c").
    std::vector<Path> prefixes() const;

    std::string to_string() const;

    bool operator==(const Path& o) const = default;
    /// Namespace order, the same in every run: parents before children, then by kind and text of
    /// the elements.
    std::strong_ordering operator<=>(const Path& o) const;

    size_t hash() const { return std::hash<const void*>()(node_); }

    struct Node;

  private:
    explicit Path(const Node* node) : node_(node) {}

    const Node* node_ = nullptr;
    friend struct PathTable;
};

/// UTF-8 identifier: '_' or XID_Start, then XID_Continue. Ref: Unicode UAX #31; AOUSD 1.0.1, 8.2.
bool is_identifier(std::string_view text);
/// Identifiers joined by ':'.
bool is_namespaced_identifier(std::string_view text);
/// Name of a variant: letters, digits, XID_Continue, '|' and '-', with an optional leading '.'.
bool is_variant_name(std::string_view text);

/// Decodes one UTF-8 code point at text[at], which must exist; `length` gets its bytes. U+FFFFFFFF
/// when malformed.
uint32_t decode_utf8(std::string_view text, size_t at, size_t& length);
bool is_xid_start(uint32_t code_point);
bool is_xid_continue(uint32_t code_point);

}  // namespace velatura::usd::layer

template <>
struct std::hash<velatura::usd::layer::Path> {
    size_t operator()(const velatura::usd::layer::Path& p) const { return p.hash(); }
};
