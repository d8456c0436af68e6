// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/site.h"

#include "base/hash.h"
#include "usd/layer/fields.h"
#include "usd/layer/value.h"

#include <cmath>
#include <functional>
#include <limits>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// An arc with its target resolved: what decides whether two layers speak of the same arc.
struct ReferenceItem {
    std::string file;
    Path prim_path;
    TimeOffset offset;
    bool operator==(const ReferenceItem& o) const = default;
};

/// NaN is not equal to itself; infinity is as unusable and is reported the same.
TimeOffset comparable(TimeOffset offset) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (std::isnan(offset.offset)) offset.offset = infinity;
    if (std::isnan(offset.scale)) offset.scale = infinity;
    return offset;
}

struct ReferenceItemHash {
    size_t operator()(const ReferenceItem& r) const {
        return size_t(hash_combine(std::hash<std::string>()(r.file), r.prim_path.hash()));
    }
};

}  // namespace

}  // namespace velatura::usd::compose

template <>
struct std::hash<velatura::usd::compose::ReferenceItem>
    : velatura::usd::compose::ReferenceItemHash {};

namespace velatura::usd::compose {

namespace {

/// Composes the list-ops of references of the layers, weakest first, and remembers who said what.
class ReferenceComposer {
  public:
    ReferenceComposer(const LayerStack& stack,
                      Path site,
                      const LayerRegistry& registry,
                      std::vector<CompositionError>* errors)
        : stack_(stack), site_(site), registry_(registry), errors_(errors) {}

    template <class Arc>
    void apply(const layer::ListOp<Arc>& op, const StackLayer& entry, SourceLoc loc) {
        layer::ListOp<ReferenceItem> mapped;
        mapped.is_explicit = op.is_explicit;
        mapped.explicit_items = convert(op.explicit_items, entry, loc, true);
        mapped.added = convert(op.added, entry, loc, true);
        mapped.prepended = convert(op.prepended, entry, loc, true);
        mapped.appended = convert(op.appended, entry, loc, true);
        mapped.deleted = convert(op.deleted, entry, loc, false);
        mapped.ordered = convert(op.ordered, entry, loc, false);
        mapped.apply_to(items_);
    }

    std::vector<SiteReference> result() const {
        std::vector<SiteReference> references;
        references.reserve(items_.size());
        for (const ReferenceItem& item : items_) references.push_back(said_.at(item));
        return references;
    }

  private:
    /// Deleted and reordered items are not `authored` here.
    template <class Arc>
    std::vector<ReferenceItem> convert(const std::vector<Arc>& from,
                                       const StackLayer& entry,
                                       SourceLoc loc,
                                       bool authored) {
        std::vector<ReferenceItem> to;
        to.reserve(from.size());
        for (const Arc& arc : from) {
            const std::optional<std::string> asset =
                stack_.evaluate(arc.asset, site_, loc, errors_);
            // An expression that comes to nothing leaves its arc out
            if (!asset || (asset->empty() && !arc.asset.empty())) continue;
            ReferenceItem item{registry_.resolve(*asset, entry.layer->identifier()), arc.prim_path,
                               comparable(arc.offset)};
            SiteReference said{*asset, item.file, item.prim_path, item.offset, &entry, loc};
            if (authored) said_.insert_or_assign(item, std::move(said));
            to.push_back(std::move(item));
        }
        return to;
    }

    const LayerStack& stack_;
    Path site_;
    const LayerRegistry& registry_;
    std::vector<CompositionError>* errors_;
    std::vector<ReferenceItem> items_;
    std::unordered_map<ReferenceItem, SiteReference> said_;
};

}  // namespace

SiteArcs site_arcs(const LayerStack& stack, Path site) {
    SiteArcs arcs;
    const layer::FieldNames& names = layer::fields();
    for (const StackLayer& entry : stack.layers()) {
        const layer::Spec* spec = entry.layer->spec(site);
        if (!spec) continue;
        arcs.has_specs = true;
        for (const layer::Field& field : spec->fields()) {
            arcs.references = arcs.references || field.name == names.references;
            arcs.payloads = arcs.payloads || field.name == names.payload;
            arcs.inherits = arcs.inherits || field.name == names.inherit_paths;
            arcs.specializes = arcs.specializes || field.name == names.specializes;
            arcs.variants = arcs.variants || field.name == names.variant_set_names;
            arcs.prim_relocates = arcs.prim_relocates || field.name == names.relocates;
        }
    }
    return arcs;
}

std::vector<SiteReference> site_references(const LayerStack& stack,
                                           Path site,
                                           bool payloads,
                                           const LayerRegistry& registry,
                                           std::vector<CompositionError>* errors) {
    ReferenceComposer composer(stack, site, registry, errors);
    const Token name = payloads ? layer::fields().payload : layer::fields().references;
    for (auto entry = stack.layers().rbegin(); entry != stack.layers().rend(); ++entry) {
        const layer::Spec* spec = entry->layer->spec(site);
        const layer::Field* field = spec ? spec->find_field(name) : nullptr;
        if (!field) continue;
        if (const auto* op = field->value.get_if<layer::ReferenceListOp>()) {
            composer.apply(*op, *entry, field->loc);
        } else if (const auto* payload_op = field->value.get_if<layer::PayloadListOp>()) {
            composer.apply(*payload_op, *entry, field->loc);
        }
    }
    return composer.result();
}

std::vector<SiteClass> site_classes(const LayerStack& stack, Path site, bool specializes) {
    const Token name = specializes ? layer::fields().specializes : layer::fields().inherit_paths;
    std::vector<Path> items;
    SourceLoc loc;
    for (auto entry = stack.layers().rbegin(); entry != stack.layers().rend(); ++entry) {
        const layer::Spec* spec = entry->layer->spec(site);
        const layer::Field* field = spec ? spec->find_field(name) : nullptr;
        if (!field) continue;
        if (const auto* op = field->value.get_if<layer::PathListOp>()) {
            op->apply_to(items);
            loc = field->loc;
        }
    }
    std::vector<SiteClass> result;
    result.reserve(items.size());
    for (const Path& path : items) result.push_back({path, loc});
    return result;
}

std::vector<std::string> site_variant_sets(const LayerStack& stack, Path site) {
    std::vector<std::string> names;
    for (auto entry = stack.layers().rbegin(); entry != stack.layers().rend(); ++entry) {
        if (const auto* op = entry->layer->field_as<layer::StringListOp>(
                site, layer::fields().variant_set_names)) {
            op->apply_to(names);
        }
    }
    return names;
}

std::optional<std::string> site_variant_selection(const LayerStack& stack,
                                                  Path site,
                                                  const std::string& set,
                                                  std::vector<CompositionError>* errors) {
    const Token name = layer::fields().variant_selection;
    for (const StackLayer& entry : stack.layers()) {
        const layer::Spec* spec = entry.layer->spec(site);
        const auto* selections = spec ? spec->field_as<layer::VariantSelections>(name) : nullptr;
        if (!selections) continue;
        for (const auto& selection : *selections) {
            if (selection.first != set) continue;
            // Without a value the next weaker opinion counts
            auto value = stack.evaluate(selection.second, site, spec->field_loc(name), errors);
            if (value) return value;
        }
    }
    return std::nullopt;
}

void site_variant_selections(const LayerStack& stack,
                             Path site,
                             std::map<std::string, std::string>& selections) {
    for (const StackLayer& entry : stack.layers()) {
        const auto* said = entry.layer->field_as<layer::VariantSelections>(
            site, layer::fields().variant_selection);
        if (!said) continue;
        for (const auto& selection : *said) {
            if (const auto value = stack.evaluate(selection.second, site, {}, nullptr))
                selections.emplace(selection.first, *value);
        }
    }
}

bool site_has_variant(const LayerStack& stack,
                      Path site,
                      const std::string& set,
                      const std::string& variant) {
    return stack.has_spec(site.append_variant_selection(Token(set), Token(variant)));
}

std::optional<bool> site_bool(const LayerStack& stack, Path site, Token field) {
    for (const StackLayer& entry : stack.layers()) {
        if (const bool* value = entry.layer->field_as<bool>(site, field)) return *value;
    }
    return std::nullopt;
}

SourceLoc site_loc(const LayerStack& stack, Path site) {
    for (const StackLayer& entry : stack.layers()) {
        if (const layer::Spec* spec = entry.layer->spec(site)) return spec->loc();
    }
    return {};
}

SourceLoc site_field_loc(const LayerStack& stack, Path site, Token field) {
    for (const StackLayer& entry : stack.layers()) {
        const layer::Spec* spec = entry.layer->spec(site);
        if (spec && spec->has_field(field)) return spec->field_loc(field);
    }
    return {};
}

}  // namespace velatura::usd::compose
