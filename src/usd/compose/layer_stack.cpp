// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/layer_stack.h"

#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace velatura::usd::compose {

using layer::Path;

class LayerStackBuilder {
  public:
    LayerStackBuilder(LayerRegistry& registry, Diagnostics& diagnostics)
        : registry_(registry), diagnostics_(diagnostics), stack_(std::make_unique<LayerStack>()) {}

    std::unique_ptr<LayerStack> build(LayerPtr root, LayerPtr session) {
        stack_->identifier_ = root->identifier();
        stack_->time_codes_per_second_ = stack_rate(*root, session.get());
        const double rate = stack_->time_codes_per_second_;
        if (session) {
            const double own = session->has_time_codes_per_second() ? checked_rate(*session) : rate;
            add(session, {0.0, rate / own}, own);
        }
        const double own = checked_rate(*root);
        add(root, {0.0, rate / own}, own);
        join_relocates();
        return std::move(stack_);
    }

  private:
    /// A session layer overrides the rate of the root layer.
    double stack_rate(const layer::Layer& root, const layer::Layer* session) {
        const layer::Token rate = layer::fields().time_codes_per_second;
        if (session && session->pseudo_root().has_field(rate)) return checked_rate(*session);
        if (!root.pseudo_root().has_field(rate) && session &&
            session->has_time_codes_per_second()) {
            return checked_rate(*session);
        }
        return checked_rate(root);
    }

    /// The layer's rate; an authored rate that is not a positive number is reported, and 24 used.
    double checked_rate(const layer::Layer& layer) {
        const layer::FieldNames& f = layer::fields();
        for (const layer::Token name : {f.time_codes_per_second, f.frames_per_second}) {
            const double* rate = layer.pseudo_root().field_as<double>(name);
            if (!rate) continue;
            if (*rate > 0.0 && *rate < 1e30) return *rate;
            diagnostics_.warn(
                "usd-bad-time-rate", layer.pseudo_root().field_loc(name), "",
                fmt::format("{} is {}, expected a positive number; 24 is used", name.str(), *rate));
            return 24.0;
        }
        return 24.0;
    }

    void add(const LayerPtr& layer, const TimeOffset& to_root, double rate) {
        stack_->layers_.push_back({layer, to_root});
        open_.push_back(layer.get());
        for (const layer::SubLayer& sub : layer->sub_layers())
            add_sub_layer(*layer, sub, to_root, rate);
        open_.pop_back();
    }

    void add_sub_layer(const layer::Layer& layer,
                       const layer::SubLayer& sub,
                       const TimeOffset& to_root,
                       double rate) {
        if (sub.asset.empty()) {
            diagnostics_.error("usd-empty-sublayer", sub.loc, "", "empty asset path in subLayers");
            return;
        }
        const std::string file = registry_.resolve(sub.asset, layer.real_path());
        Result<LayerPtr> opened = registry_.open(file);
        if (!opened) {
            diagnostics_.error(
                "usd-unresolved-sublayer", sub.loc, "",
                fmt::format("cannot open sublayer @{}@: {}", sub.asset, opened.error().message));
            return;
        }
        if (std::find(open_.begin(), open_.end(), opened->get()) != open_.end()) {
            diagnostics_.error(
                "usd-sublayer-cycle", sub.loc, "",
                fmt::format("sublayer @{}@ is already open above this one", sub.asset));
            return;
        }
        if (open_.size() >= 100 || stack_->layers_.size() >= 10000) {
            diagnostics_.error("usd-too-many-sublayers", sub.loc, "",
                               fmt::format("limit of sublayers reached at @{}@", sub.asset));
            return;
        }
        TimeOffset offset = sub.offset;
        if (!(offset.scale > 0.0)) {
            diagnostics_.error("usd-bad-layer-offset", sub.loc, "",
                               fmt::format("scale of sublayer @{}@ is {}, expected above 0",
                                           sub.asset, offset.scale));
            offset = {};
        }
        const double sub_rate = checked_rate(**opened);
        offset.scale *= rate / sub_rate;
        add(*opened, to_root.after(offset), sub_rate);
    }

    void refuse(const layer::Layer& layer, Path source, Path target, const char* why) {
        diagnostics_.error("usd-invalid-relocate",
                           layer.pseudo_root().field_loc(layer::fields().layer_relocates), "",
                           fmt::format("relocation of <{}> to <{}> is ignored: {}",
                                       source.to_string(), target.to_string(), why));
    }

    /// Collects the relocations of all layers (stronger ones win per source) and joins chains of
    /// them.
    void join_relocates() {
        layer::Relocates& single = stack_->single_relocates_;
        for (const StackLayer& entry : stack_->layers_) {
            const layer::Relocates* authored = entry.layer->relocates();
            if (!authored) continue;
            diagnostics_.warn("usd-relocates-unsupported",
                              entry.layer->pseudo_root().field_loc(layer::fields().layer_relocates),
                              "", "relocates are checked but not followed");
            for (const auto& pair : *authored) {
                if (is_valid(*entry.layer, pair.first, pair.second)) single.push_back(pair);
            }
        }
        std::sort(single.begin(), single.end());
        for (const auto& pair : single) {
            // Name the source as it was before any relocation of its ancestors
            Path source = pair.first;
            for (size_t step = 0; step <= single.size(); ++step) {
                const auto outer = std::find_if(single.begin(), single.end(), [&](const auto& p) {
                    return p != pair && !p.second.is_empty() && source.has_prefix(p.second);
                });
                if (outer == single.end()) break;
                source = source.replace_prefix(outer->second, outer->first, false);
            }
            stack_->relocates_.emplace_back(source, pair.second);
        }
        std::sort(stack_->relocates_.begin(), stack_->relocates_.end());
    }

    bool is_valid(const layer::Layer& layer, Path source, Path target) {
        const char* why = nullptr;
        if (!source.is_prim() || (!target.is_empty() && !target.is_prim())) {
            why = "source and target must be prims";
        } else if (source.is_root_prim()) {
            why = "root prims cannot be relocated";
        } else if (source == target) {
            why = "source and target are the same";
        } else if (!target.is_empty() && target.has_prefix(source)) {
            why = "the target lies below the source";
        } else if (!target.is_empty() && source.has_prefix(target)) {
            why = "the target is an ancestor of the source";
        }
        for (const auto& other : stack_->single_relocates_) {
            if (why) break;
            if (other.first == source) return false;
            if (!target.is_empty() && other.second == target)
                why = "the target has another source already";
        }
        if (why) refuse(layer, source, target, why);
        return why == nullptr;
    }

    LayerRegistry& registry_;
    Diagnostics& diagnostics_;
    std::unique_ptr<LayerStack> stack_;
    std::vector<const layer::Layer*> open_;
};

bool LayerStack::has_spec(Path path) const {
    return std::any_of(layers_.begin(), layers_.end(),
                       [&](const StackLayer& l) { return l.layer->has_spec(path); });
}

Path LayerStack::relocation_source(Path target) const {
    for (const auto& pair : relocates_) {
        if (!pair.second.is_empty() && pair.second == target) return pair.first;
    }
    return {};
}

bool LayerStack::is_relocation_source(Path path) const {
    return std::any_of(relocates_.begin(), relocates_.end(),
                       [&](const auto& p) { return p.first == path; }) ||
           std::any_of(single_relocates_.begin(), single_relocates_.end(),
                       [&](const auto& p) { return p.first == path; });
}

std::unique_ptr<LayerStack> build_layer_stack(LayerPtr root,
                                              LayerPtr session,
                                              LayerRegistry& registry,
                                              Diagnostics& diagnostics) {
    return LayerStackBuilder(registry, diagnostics).build(std::move(root), std::move(session));
}

}  // namespace velatura::usd::compose
