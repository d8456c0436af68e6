// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/mix_plan.h"

#include "compositor/look/row_names.h"
#include "compositor/look/stack_color.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace velatura::compositor::mix {

namespace {

using Gain = std::array<float, 3>;
using Term = MixPlan::Term;

void multiply(Gain& a, const Gain& b) {
    for (size_t c = 0; c < 3; ++c) a[c] *= b[c];
}

/// What the controls ask of one lobe of one bounce of one group.
struct CellGain {
    Gain gain = {1, 1, 1};
    std::vector<MattedGain> mattes;
    std::vector<MattedShare> clamp;

    bool operator==(const CellGain&) const = default;
};

class Planner {
  public:
    Planner(const LayerStack& stack, const Look& look, bool is_brief)
        : stack_(stack), look_(look), is_brief_(is_brief), rows_(stack, look) {
        cells_.resize(rows_.cell_count());
        lifts_.resize(rows_.group_count());
        plan_.faders = Faders(rows_.column_names(), rows_.group_names(), rows_.lobe_names());
    }

    Result<MixPlan> run();

  private:
    size_t matte_number(const std::string& text);
    void apply_gain(const Control& control, const Selection& selected);
    void apply_clamp(const Control& control, const Selection& selected);
    void apply_solos();
    Result<void> apply_shadow(const Control& control);
    Result<void> apply_caster(const Control& control);
    Result<void> apply_control(const Control& control);
    Result<void> learn_color();
    Result<void> apply_controls();
    Result<void> choose_family();
    Result<void> add_family(const layers::FamilyClosure& family);
    void add_plain_terms();
    Result<void> add_shadows();
    Result<void> add_shadow(const accumulate::LayerEntry& entry,
                            const std::vector<MattedShare>& lifts);
    std::string direct_layer(const std::string& group) const;
    void add_beside();
    std::optional<Gain> common_gain() const;
    const CellGain* one_gain(const accumulate::LayerEntry& entry) const;
    const CellGain* direct_gain(const std::string& group) const;
    bool is_uniform_along(bool groups) const;
    double largest_gain(const Term& term) const;
    Result<void> check_gains() const;
    Error not_stored() const;
    const accumulate::LayerEntry* clamp_of(const std::string& layer) const;

    /// Of a layer whose light has one gain.
    const CellGain& gain(const accumulate::LayerEntry& entry) const {
        return cells_[rows_.cells_of(entry).front()];
    }

    const LayerStack& stack_;
    const Look& look_;
    const bool is_brief_;
    RowNames rows_;
    std::vector<CellGain> cells_;                                   ///< as Selection
    std::vector<std::vector<MattedShare>> lifts_;                   ///< per group
    std::map<std::string, std::vector<MattedShare>> caster_lifts_;  ///< per layer
    std::map<size_t, std::vector<Selection>> solos_;                ///< per matte
    bool gives_back_ = false;
    image::ColorMatrix file_from_rec709_ = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    MixPlan plan_;
};

size_t Planner::matte_number(const std::string& text) {
    if (text.empty()) return whole_image;
    for (size_t m = 0; m < plan_.mattes.size(); ++m) {
        if (plan_.mattes[m].text == text) return m;
    }
    plan_.mattes.push_back({text, nullptr});
    return plan_.mattes.size() - 1;
}

void Planner::apply_gain(const Control& control, const Selection& selected) {
    const Gain factor = control.kind == Control::Kind::Mute ? Gain{0, 0, 0}
                        : control.kind == Control::Kind::Kelvin
                            ? kelvin_tint(control.kelvin, file_from_rec709_)
                            : control.factor;
    const size_t matte = matte_number(control.matte);
    if (matte == whole_image)
        plan_.faders.apply(control.kind, factor, selected);
    else
        plan_.faders.matted.push_back({matte, control.target, factor, selected});
    for (size_t i = 0; i < cells_.size(); ++i) {
        if (!selected[i]) continue;
        if (matte == whole_image) {
            multiply(cells_[i].gain, factor);
        } else {
            cells_[i].mattes.push_back({matte, factor});
        }
    }
}

void Planner::apply_clamp(const Control& control, const Selection& selected) {
    const size_t matte = matte_number(control.matte);
    gives_back_ = gives_back_ || control.factor[0] > 0.0f;
    for (size_t i = 0; i < cells_.size(); ++i) {
        if (selected[i] && control.factor[0] > 0.0f)
            cells_[i].clamp.push_back({matte, control.factor[0]});
    }
}

void Planner::apply_solos() {
    for (const auto& [matte, solos] : solos_) {
        Selection unheard(cells_.size());
        for (size_t i = 0; i < cells_.size(); ++i)
            unheard[i] = std::none_of(solos.begin(), solos.end(),
                                      [i](const Selection& s) { return bool(s[i]); });
        if (matte == whole_image)
            plan_.faders.mute(unheard);
        else
            plan_.faders.matted.push_back({matte, "solo", {0, 0, 0}, unheard});
        for (size_t i = 0; i < cells_.size(); ++i) {
            if (!unheard[i]) continue;
            if (matte == whole_image) {
                cells_[i].gain = {0, 0, 0};
            } else {
                cells_[i].mattes.push_back({matte, {0, 0, 0}});
            }
        }
    }
}

void add_lift(std::vector<MattedShare>& lifts, const MattedShare& lift) {
    const auto at = std::find_if(lifts.begin(), lifts.end(),
                                 [&](const MattedShare& l) { return l.matte == lift.matte; });
    if (at == lifts.end()) {
        lifts.push_back(lift);
    } else {
        at->share += lift.share;
    }
}

Result<void> Planner::apply_shadow(const Control& control) {
    const bool is_strength = control.kind != Control::Kind::Shadow;
    const auto groups = rows_.groups(is_strength ? "all" : control.target);
    if (!groups && control.target.find(':') != std::string::npos &&
        rows_.caster_layers(control.target))
        return Error{"unknown-name",
                     fmt::format("--shadow {0}: use --caster {0}=… for the shadow of one caster",
                                 control.target)};
    if (!groups) return groups.error();
    // A gain on `shadow` is the strength that is left: 1 as rendered, 0 no shadow
    const float lift = control.kind == Control::Kind::Gain   ? 1.0f - control.factor[0]
                       : control.kind == Control::Kind::Mute ? 1.0f
                                                             : control.factor[0];
    const size_t matte = matte_number(control.matte);
    for (size_t g = 0; g < groups->size(); ++g) {
        if ((*groups)[g]) add_lift(lifts_[g], {matte, lift});
    }
    return {};
}

Result<void> Planner::apply_caster(const Control& control) {
    const auto layers = rows_.caster_layers(control.target);
    if (!layers) return layers.error();
    const size_t matte = matte_number(control.matte);
    for (const std::string& layer : *layers)
        add_lift(caster_lifts_[layer], {matte, control.factor[0]});
    return {};
}

Result<void> Planner::apply_control(const Control& control) {
    using Kind = Control::Kind;
    if (control.kind == Kind::Caster) return apply_caster(control);
    const bool is_shadow_word = control.target == "shadow" && !rows_.is_row("shadow");
    if (control.kind == Kind::Shadow || is_shadow_word) {
        if (control.kind == Kind::Tint || control.kind == Kind::Kelvin ||
            control.kind == Kind::Solo || control.kind == Kind::Clamp) {
            return Error{"unknown-name", "shadow supports --shadow, --gain and --mute only"};
        }
        return apply_shadow(control);
    }
    const auto selected = rows_.select(control.target);
    if (!selected) return selected.error();
    if (control.kind == Kind::Solo) {
        solos_[matte_number(control.matte)].push_back(*selected);
    } else if (control.kind == Kind::Clamp) {
        apply_clamp(control, *selected);
    } else {
        apply_gain(control, *selected);
    }
    return {};
}

/// What a color temperature is in the file's primaries.
Result<void> Planner::learn_color() {
    const bool has_kelvin =
        std::any_of(look_.controls.begin(), look_.controls.end(),
                    [](const Control& c) { return c.kind == Control::Kind::Kelvin; });
    if (!has_kelvin && look_.input_space.empty()) return {};
    const auto color = color_of_stack(stack_, look_);
    if (!color) return color.error();
    if (has_kelvin)
        plan_.notes.insert(plan_.notes.end(), color->warnings.begin(), color->warnings.end());
    if (has_kelvin && !color->aces_from_file)
        plan_.notes.push_back(
            fmt::format("--kelvin assumes linear Rec.709, because the primaries of {} are unknown",
                        color->label));
    file_from_rec709_ = image::file_from_rec709(*color);
    return {};
}

Result<void> Planner::apply_controls() {
    std::vector<Error> unknown;
    for (const Control& control : look_.controls) {
        const auto done = apply_control(control);
        if (done) continue;
        // All unknown names at once, so that a preset of another shot is one message
        if (done.error().code != "unknown-name") return done;
        unknown.push_back(done.error());
    }
    if (!unknown.empty()) return is_brief_ ? unknown[0] : rows_.unknown(unknown);
    apply_solos();
    return {};
}

/// That of all the light which the layer holds; null where parts of it have others.
const CellGain* Planner::one_gain(const accumulate::LayerEntry& entry) const {
    const std::vector<size_t> cells = rows_.cells_of(entry);
    if (cells.empty()) return nullptr;
    // A gain that is no number is still that of its cell
    const bool is_one = std::all_of(cells.begin() + 1, cells.end(), [&](size_t cell) {
        return cells_[cell] == cells_[cells.front()];
    });
    return is_one ? &cells_[cells.front()] : nullptr;
}

/// That of a group's direct light by whatever lobe, as shadows are not told apart by lobes.
const CellGain* Planner::direct_gain(const std::string& group) const {
    accumulate::LayerEntry direct;
    direct.bounce = rows_.column_names()[rows_.direct_column()];
    direct.group = group;
    return one_gain(direct);
}

/// True if the gains are the same for all groups (or, for `groups` false, for all columns).
bool Planner::is_uniform_along(bool groups) const {
    for (size_t c = 0; c < rows_.column_count(); ++c)
        for (size_t g = 0; g < rows_.group_count(); ++g)
            for (size_t l = 0; l < rows_.lobe_count(); ++l)
                if (cells_[rows_.cell(c, g, l)] !=
                    cells_[groups ? rows_.cell(c, 0, l) : rows_.cell(0, g, l)])
                    return false;
    return true;
}

Error Planner::not_stored() const {
    const bool needs_groups = !is_uniform_along(true), needs_bounces = !is_uniform_along(false);
    const std::string what = needs_groups && needs_bounces ? "gains per bounce and per group"
                             : needs_groups                ? "gains per group"
                                                           : "gains per bounce";
    const std::string layers = needs_groups && needs_bounces ? "--layers matrix"
                               : needs_groups                ? "--layers light or --layers matrix"
                                                             : "--layers bounce or --layers matrix";
    return {"mix-not-stored",
            fmt::format("this mix needs {}, which the stored layers cannot express; render with {}",
                        what, layers)};
}

const accumulate::LayerEntry* Planner::clamp_of(const std::string& layer) const {
    const auto& layers = stack_.header().layers;
    const auto at =
        std::find_if(layers.begin(), layers.end(), [&](const accumulate::LayerEntry& e) {
            return e.family == "clamp" && e.of == layer && !e.is_empty;
        });
    return at == layers.end() ? nullptr : &*at;
}

Result<void> Planner::add_family(const layers::FamilyClosure& family) {
    plan_.family = family.family;
    const std::set<std::string> stored(family.order.begin(), family.order.end());
    for (const std::string& layer : family.order) {
        if (!stack_.header().find(layer))
            return Error{"layers-damaged",
                         fmt::format("layer {} is not in velatura/layers", layer)};
        if (auto is_there = stack_.check_stored(layer); !is_there) return is_there;
    }
    const auto add = [&](const accumulate::LayerEntry& entry) -> Result<void> {
        const CellGain& gains = gain(entry);
        Term term{entry.name, gains.gain};
        term.matted_gains = gains.mattes;
        const accumulate::LayerEntry* clamp = gains.clamp.empty() ? nullptr : clamp_of(entry.name);
        if (clamp) {
            if (auto is_there = stack_.check_stored(clamp->name); !is_there) return is_there;
            term.clamp_layer = clamp->name;
            term.clamp_shares = gains.clamp;
        }
        // A layer that the clamp took whole is black, and comes back in its place
        if (stored.count(entry.name) != 0 || clamp) plan_.terms.push_back(std::move(term));
        return {};
    };
    for (const std::string& layer : family.order) {
        if (auto added = add(*stack_.header().find(layer)); !added) return added;
    }
    if (!gives_back_) return {};
    // The order of the header holds the black layers too
    plan_.terms.clear();
    for (const accumulate::LayerEntry& entry : stack_.header().layers) {
        if (entry.family != family.family) continue;
        if (auto added = add(entry); !added) return added;
    }
    return {};
}

void Planner::add_plain_terms() {
    plan_.family = "plain";
    if (!stack_.has_beauty()) {
        // The beauty is the sum of the rows, in the order of the file
        for (const accumulate::LayerEntry& entry : stack_.header().layers) {
            if (entry.family == "plain")
                plan_.terms.push_back({entry.name, gain(entry).gain, gain(entry).mattes});
        }
        return;
    }
    // beauty = rest + rows, so a mix is rest's gain on the beauty, and what rows differ from it
    const CellGain& rest = cells_.back();
    plan_.terms.push_back({"rgba", rest.gain, rest.mattes});
    for (const accumulate::LayerEntry& entry : stack_.header().layers) {
        if (entry.family != "plain") continue;
        const CellGain& row = gain(entry);
        if (row == rest) continue;
        Gain gain = row.gain;
        if (row.mattes.empty() && rest.mattes.empty()) {
            for (size_t c = 0; c < 3; ++c) gain[c] -= rest.gain[c];
            plan_.terms.push_back({entry.name, gain});
            continue;
        }
        plan_.terms.push_back({entry.name, gain, row.mattes});
        Gain without = rest.gain;
        for (float& g : without) g = -g;
        plan_.terms.push_back({entry.name, without, rest.mattes});
    }
}

Result<void> Planner::choose_family() {
    if (stack_.is_plain()) {
        add_plain_terms();
        return {};
    }
    const auto& layers = stack_.header().layers;
    const auto can_express = [&](const std::string& family) {
        return std::all_of(layers.begin(), layers.end(), [&](const accumulate::LayerEntry& e) {
            return e.family != family || one_gain(e) != nullptr;
        });
    };
    for (const layers::FamilyClosure& family : stack_.header().closure) {
        // Layers by lobe, direct or not, have no cells of their own
        if (family.family != "lobes" && can_express(family.family)) return add_family(family);
    }
    const CellGain* all = one_gain({});
    if (!all) return not_stored();
    plan_.family = "beauty";
    plan_.terms.push_back({"rgba", all->gain, all->mattes});
    return stack_.check_stored("rgba");
}

Result<void> Planner::add_shadow(const accumulate::LayerEntry& entry,
                                 const std::vector<MattedShare>& lifts) {
    const bool is_lifted = std::any_of(lifts.begin(), lifts.end(),
                                       [](const MattedShare& l) { return l.share != 0.0f; });
    if (entry.is_empty || !is_lifted) return {};
    if (auto is_there = stack_.check_stored(entry.name); !is_there) return is_there;
    // A lifted shadow shows the light's direct light, so it takes the gain of that cell
    const CellGain* gains = direct_gain(entry.group);
    if (!gains)
        return Error{
            "mix-not-stored",
            fmt::format("shadows are not stored by lobe: --shadow and --caster of {0} need "
                        "one gain for all lobes of {0}:direct",
                        entry.group)};
    Term term{entry.name, gains->gain, gains->mattes};
    if (lifts.size() == 1 && lifts[0].matte == whole_image) {
        multiply(term.gain, {lifts[0].share, lifts[0].share, lifts[0].share});
    } else {
        term.matted_lifts = lifts;
    }
    term.direct_layer = direct_layer(entry.group);
    term.lifts = lifts;
    plan_.shadow_terms.push_back(std::move(term));
    return {};
}

Result<void> Planner::add_shadows() {
    for (size_t g = 0; g < lifts_.size(); ++g) {
        const bool is_lifted = std::any_of(lifts_[g].begin(), lifts_[g].end(),
                                           [](const MattedShare& l) { return l.share != 0.0f; });
        if (!is_lifted) continue;
        const std::string layer = "S_" + rows_.group_name(g);
        const accumulate::LayerEntry* entry = stack_.header().find(layer);
        if (!entry || entry->family != "shadow") {
            return Error{"mix-not-stored", fmt::format("this mix needs the shadow layer {}, which "
                                                       "is not stored; render with shadow among "
                                                       "--layers",
                                                       layer)};
        }
        accumulate::LayerEntry of_group = *entry;
        of_group.group = rows_.group_name(g);
        if (auto added = add_shadow(of_group, lifts_[g]); !added) return added;
    }
    for (const auto& [layer, lifts] : caster_lifts_) {
        if (auto added = add_shadow(*stack_.header().find(layer), lifts); !added) return added;
    }
    return {};
}

/// The layer of the family that holds a group's direct light; the beauty where there is no family.
std::string Planner::direct_layer(const std::string& group) const {
    if (plan_.family == "beauty") return "rgba";
    const std::vector<std::string> columns = stack_.column_names();
    for (const accumulate::LayerEntry& e : stack_.header().layers) {
        const bool is_bounce = plan_.family == "groups" || columns.empty() ||
                               e.bounce == columns[rows_.direct_column()];
        const bool is_group =
            plan_.family == "bounces" || rows_.group_of(e.group) == rows_.group_of(group);
        if (e.family == plan_.family && is_bounce && is_group) return e.name;
    }
    return {};
}

void Planner::add_beside() {
    for (const accumulate::LayerEntry& e : stack_.header().layers) {
        const bool is_row = e.family == "plain" || e.family == "clamp";
        const bool is_direct =
            e.family == "shadow" || e.family == "caster" || e.family == "unoccluded";
        if (!(is_row || is_direct)) continue;
        const CellGain* gains = is_row ? one_gain(e) : direct_gain(e.group);
        if (gains) plan_.beside.push_back({e.name, gains->gain, gains->mattes});
    }
}

std::optional<Gain> Planner::common_gain() const {
    const CellGain* all = one_gain({});
    if (!all || !all->mattes.empty() || !all->clamp.empty() || !plan_.shadow_terms.empty())
        return std::nullopt;
    return all->gain;
}

Result<MixPlan> Planner::run() {
    if (auto done = learn_color(); !done) return done.error();
    if (auto done = apply_controls(); !done) return done.error();
    if (auto done = choose_family(); !done) return done.error();
    if (auto done = add_shadows(); !done) return done.error();
    add_beside();
    plan_.common_gain = common_gain();
    const auto& layers = stack_.header().layers;
    const bool was_clamped = std::any_of(layers.begin(), layers.end(),
                                         [](const auto& e) { return e.family == "clamp"; });
    if (gives_back_ && !was_clamped)
        plan_.notes.emplace_back("--clamp has no effect: no light of this file was clamped");
    if (auto bounded = check_gains(); !bounded) return bounded.error();
    return std::move(plan_);
}

/// What a term may multiply values by, mattes where they let everything through.
double Planner::largest_gain(const Term& term) const {
    double largest = 0;
    for (size_t c = 0; c < 3; ++c) {
        double gain = std::abs(double(term.gain[c])) * std::exp2(double(look_.exposure_stops));
        for (const MattedGain& g : term.matted_gains) gain *= std::max(1.0, double(g.gain[c]));
        // An infinite gain that is muted after it is no number
        if (!std::isfinite(gain)) return std::numeric_limits<double>::infinity();
        largest = std::max(largest, gain);
    }
    return largest;
}

Result<void> Planner::check_gains() const {
    for (const Term& term : plan_.all_terms()) {
        const double gain = largest_gain(term);
        if (gain <= double(largest_factor)) continue;
        const std::string stops =
            std::isfinite(gain) ? fmt::format("{:+.4g}", std::log2(gain)) : std::string("far more");
        return Error{
            "bad-gain",
            fmt::format(
                "the gains of layer {} and the exposure add up to {} stops; the maximum is {}",
                term.layer, stops, largest_stops)};
    }
    return {};
}

}  // namespace

bool has_mattes(const Term& term) {
    return !term.matted_gains.empty() || !term.matted_lifts.empty() ||
           std::any_of(term.clamp_shares.begin(), term.clamp_shares.end(),
                       [](const MattedShare& s) { return s.matte != whole_image; });
}

std::vector<Term> MixPlan::all_terms() const {
    std::vector<Term> all = terms;
    all.insert(all.end(), shadow_terms.begin(), shadow_terms.end());
    return all;
}

float MixPlan::matte_factor(const Term& term, size_t c, size_t pixel) const {
    float factor = 1.0f;
    for (const MattedGain& g : term.matted_gains)
        factor *= 1.0f + (*mattes[g.matte].values)[pixel] * (g.gain[c] - 1.0f);
    if (term.matted_lifts.empty()) return factor;
    float lift = 0.0f;
    for (const MattedShare& l : term.matted_lifts) {
        lift += l.matte == whole_image ? l.share : l.share * (*mattes[l.matte].values)[pixel];
    }
    return factor * lift;
}

float MixPlan::clamp_share(const Term& term, size_t pixel) const {
    float share = 0.0f;
    for (const MattedShare& s : term.clamp_shares) {
        share = std::max(
            share, s.matte == whole_image ? s.share : s.share * (*mattes[s.matte].values)[pixel]);
    }
    return share;
}

Result<MixPlan> plan_gains(const LayerStack& stack, const Look& look, bool is_brief) {
    return Planner(stack, look, is_brief).run();
}

Result<MixPlan> plan_mix(const LayerStack& stack,
                         const Look& look,
                         const layers::StripReader* file,
                         size_t strip_bytes) {
    auto plan = plan_gains(stack, look);
    if (!plan) return plan;
    for (Matte& matte : plan->mattes) {
        auto loaded = load_matte(stack, file, matte.text, strip_bytes);
        if (!loaded) return loaded.error();
        plan->notes.insert(plan->notes.end(), loaded->notes.begin(), loaded->notes.end());
        matte = std::move(*loaded);
    }
    return plan;
}

}  // namespace velatura::compositor::mix
