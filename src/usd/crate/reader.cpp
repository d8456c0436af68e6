// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/reader.h"

#include "usd/crate/crate_file.h"
#include "usd/crate/field_rules.h"
#include "usd/crate/value_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <unordered_set>

namespace velatura::usd::crate {

namespace {

using layer::Field;
using layer::Path;
using layer::Spec;
using layer::SpecKind;
using layer::Token;
using layer::Value;

/// The kind of spec that a form at a path makes; nullopt when it makes none.
std::optional<SpecKind> kind_of(uint32_t form, Path path) {
    const bool is_property = path.kind() == layer::PathKind::Property;
    const bool is_variant = path.is_variant_selection();
    switch (SpecForm(form)) {
        case SpecForm::PseudoRoot:
            if (path.is_absolute_root()) return SpecKind::PseudoRoot;
            break;
        case SpecForm::Prim:
            if (path.is_prim()) return SpecKind::Prim;
            break;
        case SpecForm::Attribute:
            if (is_property) return SpecKind::Attribute;
            break;
        case SpecForm::Relationship:
            if (is_property) return SpecKind::Relationship;
            break;
        case SpecForm::Variant:
            if (is_variant && !path.variant().empty()) return SpecKind::Variant;
            break;
        case SpecForm::VariantSet:
            if (is_variant && path.variant().empty()) return SpecKind::VariantSet;
            break;
        default:
            break;
    }
    return std::nullopt;
}

/// Forms without meaning: old files keep them for targets and connections.
bool is_inert(uint32_t form) {
    switch (SpecForm(form)) {
        case SpecForm::Connection:
        case SpecForm::Expression:
        case SpecForm::Mapper:
        case SpecForm::MapperArgument:
        case SpecForm::RelationshipTarget:
            return true;
        default:
            return false;
    }
}

bool can_have_children(SpecKind parent, Token field) {
    const ChildFields& names = child_fields();
    if (field == names.variants) return parent == SpecKind::VariantSet;
    if (field == names.prims && parent == SpecKind::PseudoRoot) return true;
    return parent == SpecKind::Prim || parent == SpecKind::Variant;
}

/// Fills a layer from the tables of a file.
class LayerBuilder {
  public:
    LayerBuilder(const CrateFilePtr& file,
                 const Structure& structure,
                 layer::Layer& out,
                 Diagnostics& diagnostics)
        : file_(file),
          structure_(structure),
          layer_(out),
          diagnostics_(diagnostics),
          values_(file, file->max_copied_bytes()),
          fields_(structure.fields.size()) {}

    /// False when the file has specs but none for the layer itself.
    bool build();

  private:
    /// A field once its value is read; the same field may belong to many specs.
    struct ReadField {
        bool is_read = false;
        bool is_good = false;
        Value value;
    };

    /// A list of names of children, to be checked once all specs are there.
    struct ChildList {
        Spec* parent;
        Path path;
        uint32_t field;
    };

    void add_spec(const SpecEntry& entry);
    const Value* value_of(uint32_t field, Path path);
    void add_fields(Spec& spec, Path path, uint32_t field_set);
    void add_child_list(const ChildList& list);
    void add_children(const ChildList& list);
    bool add_child(const ChildList& list, Token field, Token name);
    void drop_unlisted();
    void error(Path path, std::string message);
    void warn(std::string message);

    CrateFilePtr file_;
    const Structure& structure_;
    layer::Layer& layer_;
    Diagnostics& diagnostics_;
    ValueReader values_;
    std::vector<ReadField> fields_;
    std::vector<Field> collected_;
    std::vector<ChildList> child_lists_;
    bool has_root_ = false;
    size_t bad_specs_ = 0;
    size_t bad_children_ = 0;
    size_t listed_ = 0;
};

void LayerBuilder::error(Path path, std::string message) {
    diagnostics_.error("usd-crate-value", file_->loc(), path.to_string(), std::move(message));
}

void LayerBuilder::warn(std::string message) {
    diagnostics_.warn("usd-crate-spec", file_->loc(), {}, std::move(message));
}

const Value* LayerBuilder::value_of(uint32_t field, Path path) {
    ReadField& f = fields_[field];
    if (!f.is_read) {
        f.is_read = true;
        const FieldEntry& entry = structure_.fields[field];
        f.is_good = values_.read(entry.value, f.value);
        if (!f.is_good) {
            const Problem& p = values_.problem();
            error(path, fmt::format("{} at byte {}; field '{}' is skipped", p.message, p.at,
                                    file_->tokens[entry.token].str()));
        }
    }
    return f.is_good ? &f.value : nullptr;
}

void LayerBuilder::add_child_list(const ChildList& list) {
    // The same list twice would name children twice
    const uint32_t token = structure_.fields[list.field].token;
    for (auto it = child_lists_.rbegin(); it != child_lists_.rend() && it->parent == list.parent;
         ++it) {
        if (structure_.fields[it->field].token == token) return;
    }
    child_lists_.push_back(list);
}

void LayerBuilder::add_fields(Spec& spec, Path path, uint32_t field_set) {
    const ChildFields& children = child_fields();
    collected_.clear();
    for (size_t i = field_set; structure_.field_sets[i] != field_set_end; ++i) {
        const uint32_t index = structure_.field_sets[i];
        const Token name = file_->tokens[structure_.fields[index].token];
        if (name == children.prims || name == children.properties ||
            name == children.variant_sets || name == children.variants) {
            add_child_list({&spec, path, index});
            continue;
        }
        if (is_inert_child_field(name)) continue;
        const Value* stored = value_of(index, path);
        if (!stored) continue;
        Value value = *stored;
        const FieldUse use = convert_field(spec.kind(), name, value);
        if (use == FieldUse::Keep) collected_.push_back({name, std::move(value), file_->loc()});
        if (use == FieldUse::Wrong) {
            error(path,
                  fmt::format(
                      "found another type of value in field '{}', expected its own; it is skipped",
                      name.str()));
        }
    }
    std::stable_sort(collected_.begin(), collected_.end(),
                     [](const Field& a, const Field& b) { return a.name < b.name; });
    const auto is_same = [](const Field& a, const Field& b) { return a.name == b.name; };
    collected_.erase(std::unique(collected_.begin(), collected_.end(), is_same), collected_.end());
    spec.set_fields(
        {std::make_move_iterator(collected_.begin()), std::make_move_iterator(collected_.end())});
    complete_fields(spec, file_->loc());
}

void LayerBuilder::add_spec(const SpecEntry& entry) {
    const Path path = file_->paths[entry.path];
    if (is_inert(entry.form)) return;
    const std::optional<SpecKind> kind = kind_of(entry.form, path);
    if (!kind) {
        ++bad_specs_;
        return;
    }
    Spec* spec = nullptr;
    if (*kind == SpecKind::PseudoRoot) {
        bad_specs_ += has_root_;
        if (has_root_) return;
        has_root_ = true;
        spec = &layer_.pseudo_root();
        spec->set_loc(file_->loc());
    } else {
        const size_t before = layer_.spec_count();
        spec = &layer_.create_spec_unlisted(path, *kind, file_->loc());
        if (layer_.spec_count() == before) {
            ++bad_specs_;
            return;
        }
    }
    add_fields(*spec, path, entry.field_set);
}

bool LayerBuilder::add_child(const ChildList& list, Token field, Token name) {
    const ChildFields& names = child_fields();
    const auto is_kind = [&](Path child, SpecKind kind) {
        const Spec* spec = child.is_empty() ? nullptr : layer_.spec(child);
        return spec && spec->kind() == kind;
    };
    if (field == names.prims) {
        if (!is_kind(list.path.append_child(name), SpecKind::Prim)) return false;
        list.parent->add_prim_child(name);
    } else if (field == names.properties) {
        const Path child = list.path.append_property(name);
        if (!is_kind(child, SpecKind::Attribute) && !is_kind(child, SpecKind::Relationship))
            return false;
        list.parent->add_property(name);
    } else if (field == names.variant_sets) {
        const Path child = list.path.append_variant_selection(name, {});
        if (!is_kind(child, SpecKind::VariantSet)) return false;
        list.parent->add_variant_child(name);
    } else {
        const Path set = list.path;
        const Path child = set.parent().append_variant_selection(set.variant_set(), name);
        if (!is_kind(child, SpecKind::Variant)) return false;
        list.parent->add_variant_child(name);
    }
    return true;
}

void LayerBuilder::add_children(const ChildList& list) {
    const Token field = file_->tokens[structure_.fields[list.field].token];
    const Value* value = value_of(list.field, list.path);
    if (!value) return;
    if (!value->holds_array<Token>() || !can_have_children(list.parent->kind(), field)) {
        error(list.path, fmt::format("found a list of children '{}' that the spec cannot have, "
                                     "expected names of its children; it is skipped",
                                     field.str()));
        return;
    }
    const std::span<const Token> names = value->as_array<Token>();
    std::unordered_set<Token> seen;
    for (const Token name : names) {
        const bool is_new = names.size() == 1 || seen.insert(name).second;
        const bool is_child = is_new && add_child(list, field, name);
        listed_ += is_child;
        bad_children_ += !is_child;
    }
}

void LayerBuilder::drop_unlisted() {
    std::unordered_set<Path> reached;
    layer_.for_each_spec(Path::absolute_root(), [&](Path p, const Spec&) { reached.insert(p); });
    size_t dropped = 0;
    for (const SpecEntry& entry : structure_.specs) {
        const Path path = file_->paths[entry.path];
        if (path.is_empty() || reached.count(path) || !layer_.has_spec(path)) continue;
        layer_.erase_spec(path);
        ++dropped;
    }
    if (dropped > 0) {
        warn(fmt::format(
            "found {} specs that no parent names as its child, expected none; they are skipped",
            dropped));
    }
}

bool LayerBuilder::build() {
    layer_.reserve(structure_.specs.size());
    for (const SpecEntry& entry : structure_.specs) add_spec(entry);
    if (!structure_.specs.empty() && !has_root_) return false;
    for (const ChildList& list : child_lists_) add_children(list);
    if (listed_ + 1 != layer_.spec_count()) drop_unlisted();
    if (bad_specs_ > 0) {
        warn(
            fmt::format("found {} specs that are unknown, repeated or at paths they cannot have, "
                        "expected none; they are skipped",
                        bad_specs_));
    }
    if (structure_.bad_paths > 0) {
        warn(
            fmt::format("found {} paths with invalid names, expected identifiers; the specs at "
                        "these paths are skipped",
                        structure_.bad_paths));
    }
    if (bad_children_ > 0) {
        warn(fmt::format(
            "found {} names of children that do not exist, expected none; they are skipped",
            bad_children_));
    }
    return true;
}

}  // namespace

Result<std::shared_ptr<layer::Layer>> read_crate_layer(const AssetBytesPtr& bytes,
                                                       const std::string& identifier,
                                                       Diagnostics& diagnostics) {
    const auto file = std::make_shared<CrateFile>(bytes, identifier, diagnostics);
    const Result<Structure> structure = read_structure(*file);
    if (!structure) return structure.error();
    auto result = std::make_shared<layer::Layer>(identifier);
    result->set_file_id(file->loc().file_id);
    if (!LayerBuilder(file, *structure, *result, diagnostics).build()) {
        return Error{"usd-crate", identifier + ": found no spec of the layer itself, expected one"};
    }
    return result;
}

}  // namespace velatura::usd::crate
