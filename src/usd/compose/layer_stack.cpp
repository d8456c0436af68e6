// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/layer_stack.h"

#include "usd/layer/expression.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

constexpr size_t max_sub_layer_depth = 100;
constexpr size_t max_stack_layers = 10'000;
/// Time codes per second; between these, products and ratios of rates stay finite.
constexpr double min_rate = 1e-30;
constexpr double greatest_rate = 1e30;
constexpr double default_rate = 24.0;

const Token& owner_field() {
    static const Token name("owner");
    return name;
}

const Token& session_owner_field() {
    static const Token name("sessionOwner");
    return name;
}

const Token& owned_sub_layers_field() {
    static const Token name("hasOwnedSubLayers");
    return name;
}

std::string text_field(const layer::Layer& layer, Token name) {
    const std::string* text = layer.pseudo_root().field_as<std::string>(name);
    return text ? *text : std::string();
}

}  // namespace

class LayerStackBuilder {
  public:
    LayerStackBuilder(LayerRegistry& registry,
                      Diagnostics& diagnostics,
                      std::vector<CompositionError>& errors)
        : registry_(registry),
          diagnostics_(diagnostics),
          errors_(errors),
          stack_(std::make_unique<LayerStack>()) {}

    std::unique_ptr<LayerStack> build(const LayerStackInputs& inputs) {
        stack_->identifier_ = inputs.root->identifier();
        stack_->root_layer_ = inputs.root.get();
        compose_variables(inputs);
        stack_->time_codes_per_second_ = stack_rate(inputs);
        const double rate = stack_->time_codes_per_second_;
        for (const LayerPtr& session : inputs.sessions) {
            const double own = session->has_time_codes_per_second() ? checked_rate(*session) : rate;
            stack_->metadata_layers_.push_back(session.get());
            add(session, {0.0, rate / own}, own);
        }
        for (const StackLayer& entry : stack_->layers_) {
            if (owner_.empty()) owner_ = text_field(*entry.layer, session_owner_field());
        }
        stack_->metadata_layers_.push_back(inputs.root.get());
        const double own = checked_rate(*inputs.root);
        add(inputs.root, {0.0, rate / own}, own);
        collect_relocates();
        return std::move(stack_);
    }

  private:
    struct Opened {
        LayerPtr layer;
        TimeOffset to_root;
        double rate;
    };

    void report(ErrorKind kind, SourceLoc loc, std::string message) {
        errors_.push_back({kind, Path::absolute_root(), stack_->identifier_, Path::absolute_root(),
                           std::move(message), loc});
    }

    void compose_variables(const LayerStackInputs& inputs) {
        layer::Dictionary own;
        if (const auto* variables = inputs.root->expression_variables()) own = *variables;
        for (auto session = inputs.sessions.rbegin(); session != inputs.sessions.rend();
             ++session) {
            if (const auto* variables = (*session)->expression_variables())
                own = variables->merged_over(own);
        }
        if (!inputs.referrer) {
            stack_->expression_variables_ = std::move(own);
            return;
        }
        // A stack that adds nothing is the same for all referrers with one source
        const layer::Dictionary& outer = inputs.referrer->expression_variables();
        layer::Dictionary composed = outer.merged_over(own);
        stack_->variables_source_ = inputs.referrer->variables_source();
        if (!(composed == outer)) {
            stack_->variables_source_ += '|';
            stack_->variables_source_ += stack_->identifier_;
        }
        stack_->expression_variables_ = std::move(composed);
    }

    /// Session layers override the rate of the root layer.
    double stack_rate(const LayerStackInputs& inputs) {
        const Token rate = layer::fields().time_codes_per_second;
        for (const LayerPtr& session : inputs.sessions)
            if (session->pseudo_root().has_field(rate)) return checked_rate(*session);
        if (inputs.root->pseudo_root().has_field(rate)) return checked_rate(*inputs.root);
        for (const LayerPtr& session : inputs.sessions)
            if (session->has_time_codes_per_second()) return checked_rate(*session);
        return checked_rate(*inputs.root);
    }

    /// The layer's rate; an authored rate out of bounds is reported, once per stack, and 24 used.
    double checked_rate(const layer::Layer& layer) {
        const layer::FieldNames& f = layer::fields();
        for (const Token name : {f.time_codes_per_second, f.frames_per_second}) {
            const double* rate = layer.pseudo_root().field_as<double>(name);
            if (!rate) continue;
            if (*rate >= min_rate && *rate <= greatest_rate) return *rate;
            if (!bad_rates_.insert(&layer).second) return default_rate;
            diagnostics_.warn(
                "usd-bad-time-rate", layer.pseudo_root().field_loc(name), "",
                fmt::format("found {} = {}, expected a number from {} to {}; {} is used",
                            name.str(), *rate, min_rate, greatest_rate, default_rate));
            return default_rate;
        }
        return default_rate;
    }

    void add(const LayerPtr& layer, const TimeOffset& to_root, double rate) {
        stack_->layers_.push_back({layer, to_root, rate});
        open_.push_back(layer.get());
        std::vector<Opened> subs;
        const std::vector<layer::SubLayer> authored = layer->sub_layers();
        std::vector<std::string> files;
        for (const layer::SubLayer& sub : authored) {
            if (!sub.asset.empty() && !layer::is_expression(sub.asset))
                files.push_back(registry_.resolve(sub.asset, layer->identifier()));
        }
        registry_.prefetch(files);
        for (const layer::SubLayer& sub : authored)
            open_sub_layer(*layer, sub, to_root, rate, subs);
        order_by_owner(*layer, subs);
        for (const Opened& sub : subs) add(sub.layer, sub.to_root, sub.rate);
        open_.pop_back();
    }

    void open_sub_layer(const layer::Layer& layer,
                        const layer::SubLayer& sub,
                        const TimeOffset& to_root,
                        double rate,
                        std::vector<Opened>& subs) {
        const std::optional<std::string> asset =
            stack_->evaluate(sub.asset, Path::absolute_root(), sub.loc, &errors_);
        if (!asset) return;
        if (asset->empty()) {
            // An expression may choose to have no sublayer
            if (sub.asset.empty())
                diagnostics_.error("usd-empty-sublayer", sub.loc, "",
                                   "empty asset path in subLayers");
            return;
        }
        Result<LayerPtr> opened = registry_.open(registry_.resolve(*asset, layer.identifier()));
        if (!opened) {
            report(ErrorKind::InvalidSublayerPath, sub.loc,
                   fmt::format("cannot open sublayer @{}@: {}", *asset, opened.error().message));
            return;
        }
        if (std::find(open_.begin(), open_.end(), opened->get()) != open_.end()) {
            report(ErrorKind::SublayerCycle, sub.loc,
                   fmt::format("sublayer @{}@ is already open above this one", *asset));
            return;
        }
        if (open_.size() >= max_sub_layer_depth || stack_->layers_.size() >= max_stack_layers) {
            if (!is_full_)
                report(
                    ErrorKind::CapacityExceeded, sub.loc,
                    fmt::format("limit of {} layers in a stack or {} nested ones reached at @{}@",
                                max_stack_layers, max_sub_layer_depth, *asset));
            is_full_ = true;
            return;
        }
        TimeOffset offset = sub.offset;
        if (!is_usable(offset)) {
            report(ErrorKind::InvalidSublayerOffset, sub.loc,
                   fmt::format("offset of sublayer @{}@ is {} and its scale {}, expected finite "
                               "numbers and a scale above 0",
                               *asset, offset.offset, offset.scale));
            offset = {};
        }
        const double sub_rate = checked_rate(**opened);
        offset.scale *= rate / sub_rate;
        subs.push_back({*opened, to_root.after(offset), sub_rate});
    }

    /// The sublayer of the session's owner is the strongest of its siblings.
    void order_by_owner(const layer::Layer& layer, std::vector<Opened>& subs) {
        const bool* has_owned = layer.pseudo_root().field_as<bool>(owned_sub_layers_field());
        if (owner_.empty() || !has_owned || !*has_owned) return;
        const auto is_owned = [&](const Opened& sub) {
            return text_field(*sub.layer, owner_field()) == owner_;
        };
        const auto rest = std::stable_partition(subs.begin(), subs.end(), is_owned);
        if (rest - subs.begin() > 1) {
            report(ErrorKind::InvalidSublayerOwnership,
                   layer.pseudo_root().field_loc(layer::fields().sub_layers),
                   fmt::format("{} sublayers belong to the session's owner {}, expected one",
                               rest - subs.begin(), owner_));
        }
    }

    void collect_relocates() {
        std::vector<AuthoredRelocate> authored;
        for (const StackLayer& entry : stack_->layers_) {
            const layer::Relocates* relocates = entry.layer->relocates();
            if (!relocates) continue;
            const SourceLoc loc =
                entry.layer->pseudo_root().field_loc(layer::fields().layer_relocates);
            const Path root = Path::absolute_root();
            for (const auto& pair : *relocates) {
                authored.push_back({pair.first.make_absolute(root), pair.second.make_absolute(root),
                                    entry.layer->identifier(), loc});
            }
        }
        if (!authored.empty()) stack_->relocations_ = Relocations(authored, errors_);
    }

    LayerRegistry& registry_;
    Diagnostics& diagnostics_;
    std::vector<CompositionError>& errors_;
    std::unique_ptr<LayerStack> stack_;
    std::vector<const layer::Layer*> open_;
    std::set<const layer::Layer*> bad_rates_;  ///< reported already
    std::string owner_;
    bool is_full_ = false;
};

bool LayerStack::has_spec(Path path) const {
    return std::any_of(layers_.begin(), layers_.end(),
                       [&](const StackLayer& l) { return l.layer->has_spec(path); });
}

std::optional<std::string> LayerStack::evaluate(const std::string& text,
                                                Path site,
                                                SourceLoc loc,
                                                std::vector<CompositionError>* errors) const {
    if (!layer::is_expression(text)) return text;
    const layer::ExpressionResult result = layer::evaluate_expression(text, expression_variables_);
    std::string why = fmt::format("{}", fmt::join(result.errors, "; "));
    if (result.errors.empty()) {
        if (const std::string* value = result.value.get_if<std::string>()) return *value;
        // No value at all is a way to say "nothing here"
        if (result.value.is_empty() || result.value.is_block()) return std::string();
        why = "the value is not a string";
    }
    if (errors) {
        errors->push_back({ErrorKind::VariableExpression, site, identifier_, site,
                           fmt::format("expression {} has no value: {}", text, why), loc});
    }
    return std::nullopt;
}

std::unique_ptr<LayerStack> build_layer_stack(const LayerStackInputs& inputs,
                                              LayerRegistry& registry,
                                              Diagnostics& diagnostics,
                                              std::vector<CompositionError>& errors) {
    return LayerStackBuilder(registry, diagnostics, errors).build(inputs);
}

}  // namespace velatura::usd::compose
