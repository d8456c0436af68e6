// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/site.h"

#include "base/hash.h"
#include "usd/layer/fields.h"
#include "usd/layer/value.h"

#include <algorithm>
#include <functional>

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

/// Applies one layer's list-op of references to the list of the weaker layers, and remembers who
/// said what.
template <class Arc>
void apply_references(const layer::ListOp<Arc>& op,
                      const StackLayer& entry,
                      SourceLoc loc,
                      const LayerRegistry& registry,
                      std::vector<ReferenceItem>& items,
                      std::unordered_map<ReferenceItem, SiteReference>& info) {
    const auto convert = [&](const std::vector<Arc>& from) {
        std::vector<ReferenceItem> to;
        for (const Arc& arc : from) {
            ReferenceItem item{registry.resolve(arc.asset, entry.layer->real_path()), arc.prim_path,
                               arc.offset};
            SiteReference said{arc.asset, item.file, item.prim_path, item.offset, &entry, loc};
            info.insert_or_assign(item, std::move(said));
            to.push_back(std::move(item));
        }
        return to;
    };
    layer::ListOp<ReferenceItem> mapped;
    mapped.is_explicit = op.is_explicit;
    mapped.explicit_items = convert(op.explicit_items);
    mapped.added = convert(op.added);
    mapped.prepended = convert(op.prepended);
    mapped.appended = convert(op.appended);
    // Deleted and reordered items must not claim authorship
    const auto keep = info;
    mapped.deleted = convert(op.deleted);
    mapped.ordered = convert(op.ordered);
    info = keep;
    mapped.apply_to(items);
}

}  // namespace

std::vector<SiteReference> site_references(const LayerStack& stack,
                                           Path site,
                                           bool payloads,
                                           const LayerRegistry& registry) {
    std::vector<ReferenceItem> items;
    std::unordered_map<ReferenceItem, SiteReference> info;
    const Token name = payloads ? layer::fields().payload : layer::fields().references;
    for (auto entry = stack.layers().rbegin(); entry != stack.layers().rend(); ++entry) {
        const layer::Spec* spec = entry->layer->spec(site);
        const layer::Field* field = spec ? spec->find_field(name) : nullptr;
        if (!field) continue;
        if (const auto* op = field->value.get_if<layer::ReferenceListOp>()) {
            apply_references(*op, *entry, field->loc, registry, items, info);
        } else if (const auto* payload_op = field->value.get_if<layer::PayloadListOp>()) {
            apply_references(*payload_op, *entry, field->loc, registry, items, info);
        }
    }
    std::vector<SiteReference> result;
    result.reserve(items.size());
    for (const ReferenceItem& item : items) result.push_back(info.at(item));
    return result;
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
                                                  const std::string& set) {
    for (const StackLayer& entry : stack.layers()) {
        const auto* selections = entry.layer->field_as<layer::VariantSelections>(
            site, layer::fields().variant_selection);
        if (!selections) continue;
        for (const auto& selection : *selections) {
            if (selection.first == set) return selection.second;
        }
    }
    return std::nullopt;
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

SourceLoc site_field_loc(const LayerStack& stack, Path site, Token field) {
    for (const StackLayer& entry : stack.layers()) {
        const layer::Spec* spec = entry.layer->spec(site);
        if (spec && spec->has_field(field)) return spec->field_loc(field);
    }
    return {};
}

}  // namespace velatura::usd::compose
