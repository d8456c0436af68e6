// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/hash.h"
#include "base/source_loc.h"
#include "usd/layer/path.h"
#include "usd/layer/pointer_table.h"
#include "usd/layer/token.h"
#include "usd/layer/types.h"
#include "usd/layer/value.h"

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace velatura::usd::layer {

enum class SpecKind : uint8_t { PseudoRoot, Prim, Attribute, Relationship, VariantSet, Variant };

/// One authored opinion.
struct Field {
    Token name;
    Value value;
    SourceLoc loc;
};

/// What one layer says about one object: fields, and the names of its children in authored order.
class Spec {
  public:
    Spec() = default;

    Spec(SpecKind kind, SourceLoc loc) : kind_(kind), loc_(loc) {}

    SpecKind kind() const { return kind_; }

    SourceLoc loc() const { return loc_; }

    /// Every field, sorted by name.
    std::span<const Field> fields() const { return fields_; }

    /// The field of a name, else nullptr.
    const Field* find_field(Token name) const;

    /// The value of a field, else nullptr.
    const Value* field(Token name) const {
        const Field* f = find_field(name);
        return f ? &f->value : nullptr;
    }

    /// The value of a field when it is exactly a T, else nullptr.
    template <ValueElement T>
    const T* field_as(Token name) const {
        const Value* v = field(name);
        return v ? v->get_if<T>() : nullptr;
    }

    bool has_field(Token name) const { return find_field(name) != nullptr; }

    /// Place of a field's opinion; the spec's own place where the field has none.
    SourceLoc field_loc(Token name) const;

    /// Prims below a prim, variant or the pseudo-root.
    std::span<const Token> prim_children() const { return list(&Children::prims); }

    std::span<const Token> properties() const { return list(&Children::properties); }

    /// Variant sets below a prim or variant; the variants of a variant set.
    std::span<const Token> variant_sets() const { return list(&Children::variants); }

    std::span<const Token> variants() const { return list(&Children::variants); }

    /// Specifier of a prim spec, `over` where there is none.
    Specifier specifier() const;
    /// typeName of a prim or attribute; empty where there is none.
    Token type_name() const;
    bool is_custom() const;
    /// Where nothing else is authored, relationships are uniform and attributes varying.
    Variability variability() const;

    void set_field(Token name, Value value, SourceLoc loc);

    /// Replaces all fields; they must be sorted by name, each name once.
    void set_fields(std::vector<Field> fields) { fields_ = std::move(fields); }

    void set_loc(SourceLoc loc) { loc_ = loc; }

    void add_prim_child(Token name) { children().prims.push_back(name); }

    void add_property(Token name) { children().properties.push_back(name); }

    void add_variant_child(Token name) { children().variants.push_back(name); }

  private:
    struct Children {
        std::vector<Token> prims;
        std::vector<Token> properties;
        std::vector<Token> variants;
    };

    std::span<const Token> list(std::vector<Token> Children::*which) const {
        return children_ ? std::span<const Token>(*children_.*which) : std::span<const Token>();
    }

    Children& children() {
        if (!children_) children_ = std::make_unique<Children>();
        return *children_;
    }

    SpecKind kind_ = SpecKind::Prim;
    SourceLoc loc_;
    std::vector<Field> fields_;
    std::unique_ptr<Children> children_;
};

/// A sub-layer as authored.
struct SubLayer {
    std::string asset;
    LayerOffset offset;
    SourceLoc loc;
};

/// One file's opinions: a map from path to spec. Built by a reader, then read-only and shared
/// across threads. Specs of variants live at "/Prim{set=variant}", of variant sets at
/// "/Prim{set=}". Ref: AOUSD Core Specification 1.0.1, chapter 7 (layers); Pixar's Sdf.
class Layer {
  public:
    explicit Layer(std::string identifier);
    Layer(const Layer&) = delete;
    Layer& operator=(const Layer&) = delete;

    /// The resolved name it was opened by, against which its asset paths are resolved.
    const std::string& identifier() const { return identifier_; }

    /// Diagnostics id of the file.
    uint32_t file_id() const { return file_id_; }

    void set_file_id(uint32_t id) { file_id_ = id; }

    const Spec& pseudo_root() const { return *root_; }

    Spec& pseudo_root() { return *root_; }

    /// The spec at an absolute path, else nullptr.
    const Spec* spec(Path path) const {
        const Entry* entry = find(path);
        return entry ? &entry->spec : nullptr;
    }

    Spec* spec(Path path) {
        Entry* entry = find(path);
        return entry ? &entry->spec : nullptr;
    }

    bool has_spec(Path path) const { return find(path) != nullptr; }

    size_t spec_count() const { return spec_count_; }

    const Value* field(Path path, Token name) const {
        const Spec* s = spec(path);
        return s ? s->field(name) : nullptr;
    }

    template <ValueElement T>
    const T* field_as(Path path, Token name) const {
        const Value* v = field(path, name);
        return v ? v->get_if<T>() : nullptr;
    }

    /// Adds a spec and names it in its parent's list of children; the parent must exist. Returns
    /// the spec that is there already, unchanged, when there is one.
    Spec& create_spec(Path path, SpecKind kind, SourceLoc loc);
    /// Adds a spec without touching any list of children: for readers that bring lists of their
    /// own.
    Spec& create_spec_unlisted(Path path, SpecKind kind, SourceLoc loc);

    /// Forgets a spec that no list of children names.
    void erase_spec(Path path);

    void reserve(size_t specs) { index_.reserve(specs); }

    /// Calls visit for every spec at or below `from`, parents first, children in authored order.
    void for_each_spec(Path from, const std::function<void(Path, const Spec&)>& visit) const;

    // Layer metadata; fallbacks where nothing is authored.
    /// Path of the default prim ("/World"); empty when none is named or the name is no prim path.
    Path default_prim() const;
    std::vector<SubLayer> sub_layers() const;
    /// timeCodesPerSecond, else framesPerSecond, else 24.
    double time_codes_per_second() const;
    bool has_time_codes_per_second() const;  ///< timeCodesPerSecond or framesPerSecond is authored
    const Relocates* relocates() const;      ///< layer relocates, else nullptr
    const Dictionary* expression_variables() const;

  private:
    struct Entry {
        Path path;
        Spec spec;
    };

    Entry* find(Path path) const {
        return index_.find(mix64(path.hash()), [&](const Entry& e) { return e.path == path; });
    }

    Spec& add_entry(Path path, SpecKind kind, SourceLoc loc);

    std::string identifier_;
    uint32_t file_id_ = 0;
    std::deque<Entry> entries_;  ///< erased ones have an empty path
    PointerTable<Entry> index_;
    size_t spec_count_ = 0;
    Spec* root_ = nullptr;
};

}  // namespace velatura::usd::layer
