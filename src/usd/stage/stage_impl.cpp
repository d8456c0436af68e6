// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/fields.h"
#include "usd/stage/asset_expression.h"
#include "usd/stage/clips.h"
#include "usd/stage/prim_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace velatura::usd::stage {

using layer::Path;
using layer::Specifier;
using layer::Token;
using layer::Value;

StageImpl::StageImpl(StageOptions options, Diagnostics& diagnostics)
    : options_(std::move(options)),
      diagnostics_(diagnostics),
      composer_(options_.compose, diagnostics) {}

Result<bool> StageImpl::open(const std::string& path) {
    std::error_code failed;
    const auto absolute = [&](const std::string& file) {
        return file.empty() ? file
                            : std::filesystem::absolute(file, failed).lexically_normal().string();
    };
    compose::SessionLayers session{options_.made_layer, {}};
    for (const std::string& file : options_.session_layers) session.files.push_back(absolute(file));
    const bool is_in_memory = session.made && session.made->identifier() == path;
    const Result<compose::LayerStack*> opened =
        composer_.open(is_in_memory ? path : absolute(path), session);
    if (!opened) return opened.error();
    populate();
    return true;
}

void StageImpl::populate() {
    root_ = make_prim(nullptr, composer_.root_index());
    std::vector<PrimData*> open = {root_.get()};
    while (!open.empty()) {
        PrimData* prim = open.back();
        open.pop_back();
        // Of equal instances only the first is composed further now
        if (prim->is_instance && prim->prototype != prim) continue;
        expand(*prim);
        for (auto child = prim->children.rbegin(); child != prim->children.rend(); ++child) {
            open.push_back(child->get());
        }
    }
}

void StageImpl::ensure_children(const PrimData& prim) {
    if (prim.expanded.load(std::memory_order_acquire)) return;
    const std::lock_guard lock(mutex_);
    if (!prim.expanded.load(std::memory_order_relaxed)) expand(const_cast<PrimData&>(prim));
}

void StageImpl::expand(PrimData& prim) {
    if (prim.is_active) {
        const auto names = composer_.child_names(prim.index, prim.is_instance);
        if (prim.path.element_count() >= options_.compose.max_path_depth && !names.empty()) {
            diagnostics_.error(
                "usd-too-deep", prim.specs.empty() ? SourceLoc{} : prim.specs.front().spec->loc(),
                prim.path.to_string(), "limit of namespace depth reached; children are skipped");
        } else {
            prim.children.reserve(names.size());
            for (const Token& name : names) {
                prim.children.push_back(
                    make_prim(&prim, composer_.child_index(prim.index, name, prim.is_instance)));
            }
        }
    }
    prim.expanded.store(true, std::memory_order_release);
}

std::unique_ptr<PrimData> StageImpl::make_prim(PrimData* parent, compose::PrimIndex index) {
    auto prim = std::make_unique<PrimData>();
    prim->stage = this;
    prim->parent = parent;
    prim->index = std::move(index);
    prim->path = prim->index.path();
    for (const int i : prim->index.contributing()) {
        const compose::Node& node = prim->index.nodes()[size_t(i)];
        for (const compose::StackLayer& entry : node.stack->layers()) {
            if (const layer::Spec* spec = entry.layer->spec(node.path))
                prim->specs.push_back({spec, &entry, i});
        }
    }
    read_prim(*prim);
    read_clips(*prim);
    classify(*prim);
    ++prim_count_;
    return prim;
}

void StageImpl::read_prim(PrimData& prim) {
    if (!prim.parent) {
        prim.specifier = Specifier::Def;
        return;
    }
    bool has_active = false;
    bool has_instanceable = false;
    bool decided = false;
    for (const SpecRef& ref : prim.specs) {
        if (prim.type_name.empty()) prim.type_name = ref.spec->type_name();
        if (!has_active) {
            if (const bool* active = ref.spec->field_as<bool>(layer::fields().active)) {
                prim.is_active = *active;
                has_active = true;
            }
        }
        if (!has_instanceable) {
            if (const bool* flag = ref.spec->field_as<bool>(layer::fields().instanceable)) {
                prim.is_instanceable = *flag;
                has_instanceable = true;
            }
        }
        // A class that is inherited here says nothing about this prim, unless no one else does
        const Specifier said = ref.spec->specifier();
        if (decided || said == Specifier::Over) continue;
        const compose::Node& node = prim.index.nodes()[size_t(ref.node)];
        const bool direct_inherit = node.arc == compose::ArcType::Inherit && !node.due_to_ancestor;
        prim.specifier = said;
        decided = said == Specifier::Def || !direct_inherit;
    }
}

void StageImpl::read_clips(PrimData& prim) {
    if (prim.parent) prim.clips = prim.parent->clips;
    const auto has_clips = [](const SpecRef& ref) {
        return ref.spec->has_field(layer::fields().clips);
    };
    if (std::none_of(prim.specs.begin(), prim.specs.end(), has_clips)) return;
    auto sets = std::make_shared<ClipSets>();
    for (ClipDefinition& definition :
         read_clip_definitions(prim, composer_.registry(), diagnostics_)) {
        const SourceLoc loc = prim.specs.front().spec->field_loc(layer::fields().clips);
        const AssetAnchor anchor{definition.anchor->layer, definition.stack};
        const auto open = [this, loc, anchor](const std::string& asset) {
            return open_asset_layer(evaluate_asset(asset, anchor, "", loc, diagnostics_),
                                    *anchor.layer, "clip", loc);
        };
        sets->push_back(std::make_shared<const ClipSet>(std::move(definition), open));
    }
    if (prim.clips) sets->insert(sets->end(), prim.clips->begin(), prim.clips->end());
    if (!sets->empty()) prim.clips = std::move(sets);
}

void StageImpl::classify(PrimData& prim) {
    PrimData* parent = prim.parent;
    if (!parent) {
        prim.is_defined = true;
        prim.is_group = true;
        return;
    }
    // Below an instance the prototype is the root: the instance's own surroundings say nothing
    const bool at_top = parent->is_instance;
    prim.is_active = prim.is_active && parent->is_active;
    prim.is_defined = (at_top || parent->is_defined) && prim.specifier != Specifier::Over;
    prim.is_abstract = (!at_top && parent->is_abstract) || prim.specifier == Specifier::Class;
    prim.is_loaded = parent->is_loaded && prim.is_active &&
                     (!prim.index.has_payloads() || prim.index.payloads_included());
    prim.is_instance_proxy = parent->is_instance || parent->is_instance_proxy;
    if (at_top || parent->is_group) {
        Token kind;
        for (const SpecRef& ref : prim.specs) {
            if (const Token* said = ref.spec->field_as<Token>(layer::fields().kind)) {
                kind = *said;
                break;
            }
        }
        prim.is_group = kind == "group" || kind == "assembly";
        prim.is_model = prim.is_group || kind == "component" || kind == "model";
    }
    prim.is_instance = prim.is_instanceable && prim.is_active && prim.index.has_direct_arc();
    if (!prim.is_instance) return;
    const std::string key = prim.index.instance_key();
    const auto found = prototype_of_key_.emplace(key, &prim);
    prim.prototype = found.first->second;
    if (found.second) prototypes_.push_back(&prim);
}

const PrimData* StageImpl::find(const Path& path) {
    if (path.is_empty() || !path.is_absolute()) return nullptr;
    const PrimData* at = root_.get();
    for (const Path& prefix : path.prefixes()) {
        if (!prefix.is_prim()) return nullptr;
        ensure_children(*at);
        const Token name = prefix.name();
        const auto child = std::find_if(at->children.begin(), at->children.end(),
                                        [&](const auto& c) { return c->path.name() == name; });
        if (child == at->children.end()) return nullptr;
        at = child->get();
    }
    return at;
}

const std::vector<const layer::Layer*>& StageImpl::root_layers() const {
    return composer_.root_stack()->metadata_layers();
}

const Value* StageImpl::root_field(Token name) const {
    for (const layer::Layer* layer : root_layers()) {
        if (const Value* value = layer->pseudo_root().field(name)) return value;
    }
    return nullptr;
}

std::string StageImpl::resolve_asset(const std::string& asset, const layer::Layer& layer) {
    const std::lock_guard lock(mutex_);
    return composer_.registry().resolve(asset, layer.identifier());
}

compose::LayerPtr StageImpl::open_asset_layer(const std::string& asset,
                                              const layer::Layer& from,
                                              const std::string& what,
                                              SourceLoc loc) {
    const std::lock_guard lock(mutex_);
    const std::string file = composer_.registry().resolve(asset, from.identifier());
    const Result<compose::LayerPtr> opened = composer_.registry().open(file);
    if (opened) return *opened;
    diagnostics_.error(
        "usd-missing-layer", loc, "",
        fmt::format("{} layer @{}@ cannot be opened: {}", what, asset, opened.error().message));
    return nullptr;
}

}  // namespace velatura::usd::stage
