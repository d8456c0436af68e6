// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/web_rows.h"

#include "compositor/look/look_rows.h"
#include "compositor/look/row_names.h"
#include "compositor/look/stack_color.h"
#include "compositor/mix/mix_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>

namespace velatura::compositor::exports {

namespace {

using json = nlohmann::ordered_json;
using Kind = Control::Kind;

std::vector<size_t> numbers_of(const std::vector<bool>& selected) {
    std::vector<size_t> numbers;
    for (size_t i = 0; i < selected.size(); ++i)
        if (selected[i]) numbers.push_back(i);
    return numbers;
}

bool is_shadow_word(const Control& control, const RowNames& names) {
    return control.target == "shadow" && !names.is_row("shadow");
}

/// A keyed value is what it is at the frame of the look.
std::string value_of(const Control& c) {
    if (c.keys.empty()) return c.value;
    if (c.kind == Kind::Tint) return fmt::format("{},{},{}", c.factor[0], c.factor[1], c.factor[2]);
    return fmt::format("{}", c.kind == Kind::Kelvin ? c.kelvin : c.factor[0]);
}

/// Of every cell.
std::vector<std::array<float, 3>> gains_of(const Faders& faders) {
    std::vector<std::array<float, 3>> gains(faders.cells.size());
    for (size_t b = 0; b < faders.bounces.size(); ++b)
        for (size_t g = 0; g < faders.groups.size(); ++g)
            for (size_t l = 0; l < faders.lobes.size(); ++l)
                gains[faders.place(b, g, l)] = faders.factor(b, g, l);
    return gains;
}

/// As the page decides it: all light of a layer has one gain.
bool can_express(const json& family, const std::vector<std::array<float, 3>>& gains) {
    return std::all_of(family["terms"].begin(), family["terms"].end(), [&](const json& term) {
        const json& cells = term["cells"];
        return std::all_of(cells.begin(), cells.end(), [&](size_t cell) {
            return gains[cell] == gains[cells.front().get<size_t>()];
        });
    });
}

class RowsMaker {
  public:
    RowsMaker(const LayerStack& stack, const Look& look)
        : stack_(stack), look_(look), names_(stack, look), rows_(mixer_rows(stack)) {}

    Result<WebRows> run(const std::string& family);

  private:
    size_t plane_of(const std::string& layer);
    Result<void> add_families(const std::string& asked, bool needs_lobes);
    bool needs_lobes(const Faders& faders) const;
    void add_family(const layers::FamilyClosure& family);
    void add_plain();
    Result<void> add_shadows();
    Result<void> add_targets();
    void add_names();
    Result<void> add_look();
    Result<void> check_look() const;

    json row_of(const std::string& name) const {
        return {{"name", name}, {"title", row_title(name)}};
    }

    const LayerStack& stack_;
    const Look& look_;
    const RowNames names_;
    const MixerRows rows_;
    std::map<std::string, size_t> planes_;
    WebRows made_;
};

size_t RowsMaker::plane_of(const std::string& layer) {
    const auto [at, is_new] = planes_.try_emplace(layer, made_.layers.size());
    if (is_new) made_.layers.push_back(layer);
    return at->second;
}

void RowsMaker::add_family(const layers::FamilyClosure& family) {
    json terms = json::array();
    for (const std::string& layer : family.order) {
        const accumulate::LayerEntry* entry = stack_.header().find(layer);
        if (!entry) continue;
        const size_t plane = plane_of(layer);
        terms.push_back({{"plane", plane}, {"cells", names_.cells_of(*entry)}});
        if (made_.data["families"].empty()) made_.unity.push_back(plane);
    }
    made_.data["families"].push_back({{"name", family.family}, {"terms", std::move(terms)}});
}

/// Rows of another renderer. With a beauty, `rest` is what they leave of it: its gain is that of
/// the beauty, and a row counts by how much its gain differs.
void RowsMaker::add_plain() {
    json terms = json::array();
    const size_t rest = names_.cell_count() - 1;
    if (stack_.has_beauty()) {
        made_.unity.push_back(plane_of("rgba"));
        terms.push_back({{"plane", plane_of("rgba")}, {"cells", json::array({rest})}});
    }
    for (const accumulate::LayerEntry& entry : stack_.header().layers) {
        if (entry.family != "plain") continue;
        const size_t plane = plane_of(entry.name);
        terms.push_back({{"plane", plane}, {"cells", names_.cells_of(entry)}});
        if (!stack_.has_beauty()) made_.unity.push_back(plane);
    }
    json family = {{"name", "plain"}, {"terms", std::move(terms)}};
    if (stack_.has_beauty()) family["rest"] = rest;
    made_.data["families"].push_back(std::move(family));
}

/// Whether some light has a gain of its own by lobe.
bool RowsMaker::needs_lobes(const Faders& faders) const {
    const auto gains = gains_of(faders);
    for (size_t c = 0; c < names_.column_count(); ++c) {
        for (size_t g = 0; g < names_.group_count(); ++g) {
            accumulate::LayerEntry light;
            light.bounce = names_.column_names()[c];
            light.group = names_.group_name(g);
            const std::vector<size_t> cells = names_.cells_of(light);
            for (const size_t cell : cells)
                if (gains[cell] != gains[cells.front()]) return true;
        }
    }
    return false;
}

Result<void> RowsMaker::add_families(const std::string& asked, bool needs_lobes) {
    made_.data["families"] = json::array();
    if (stack_.is_plain()) {
        if (!asked.empty())
            return Error{"mix-not-stored",
                         fmt::format("--layers {}: a file of another renderer has "
                                     "rows of its own",
                                     asked)};
        add_plain();
        return {};
    }
    static const std::map<std::string, std::string> family_of = {{"lobe-matrix", "lobe-matrix"},
                                                                 {"matrix", "matrix"},
                                                                 {"light", "groups"},
                                                                 {"bounce", "bounces"}};
    if (!asked.empty() && !stack_.has_family(family_of.at(asked)))
        return Error{"mix-not-stored",
                     fmt::format("--layers {0}: not stored; render with --layers {0}", asked)};
    // The fewest layers that have a fader for all that the look turns
    const bool takes_lobes =
        stack_.has_family("lobe-matrix") && (needs_lobes || !stack_.has_family("matrix"));
    const std::string cells = takes_lobes ? "lobe-matrix" : "matrix";
    for (const layers::FamilyClosure& family : stack_.header().closure) {
        const bool is_known = std::any_of(family_of.begin(), family_of.end(),
                                          [&](const auto& f) { return f.second == family.family; });
        const bool is_wanted = asked.empty() ? family.family == cells || !stack_.has_family(cells)
                                             : family.family == family_of.at(asked);
        if (!is_known || !is_wanted) continue;
        for (const std::string& layer : family.order) {
            if (auto is_there = stack_.check_stored(layer); !is_there) return is_there;
        }
        add_family(family);
    }
    if (!made_.data["families"].empty()) return {};
    if (auto is_there = stack_.check_stored("rgba"); !is_there) return is_there;
    made_.unity.push_back(plane_of("rgba"));
    const json terms = json::array(
        {{{"plane", plane_of("rgba")}, {"cells", names_.cells_of(accumulate::LayerEntry())}}});
    made_.data["families"].push_back({{"name", "beauty"}, {"terms", terms}});
    return {};
}

Result<void> RowsMaker::add_shadows() {
    json shadows = json::array(), casters = json::array();
    const auto add = [&](const std::string& layer, const std::string& name,
                         const std::string& group, json& to) -> Result<void> {
        if (auto is_there = stack_.check_stored(layer); !is_there) return is_there;
        json row = row_of(name);
        row["plane"] = plane_of(layer);
        // A lifted shadow shows the light's direct light, so it takes the gain of that cell
        accumulate::LayerEntry direct;
        direct.bounce = names_.column_names()[names_.direct_column()];
        direct.group = names_.group_name(names_.group_of(group));
        row["cells"] = names_.cells_of(direct);
        row["group"] = group;
        to.push_back(std::move(row));
        return {};
    };
    for (const std::string& group : rows_.shadows) {
        if (auto added = add("S_" + group, group, group, shadows); !added) return added;
    }
    for (const accumulate::LayerEntry& e : stack_.header().layers) {
        if (e.family != "caster" || e.is_empty) continue;
        if (auto added = add(e.name, e.group + ":" + e.caster, e.group, casters); !added)
            return added;
    }
    made_.data["shadows"] = std::move(shadows);
    made_.data["casters"] = std::move(casters);
    return {};
}

/// What names stand for: those of rows, and of the controls of the look.
Result<void> RowsMaker::add_targets() {
    json cells = json::object(), shadows = json::object(), casters = json::object();
    const auto add_cells = [&](const std::string& name) -> Result<void> {
        const auto selected = names_.select(name);
        if (!selected) return selected.error();
        cells[name] = numbers_of(*selected);
        return {};
    };
    for (const auto* names : {&rows_.lights, &rows_.bounces, &rows_.lobes}) {
        for (const std::string& name : *names)
            if (auto added = add_cells(name); !added) return added;
    }
    for (const auto& [name, list] : look_.rows)
        if (auto added = add_cells(name); !added) return added;
    for (const std::string& group : rows_.groups) {
        for (const std::string& column : rows_.columns)
            if (auto added = add_cells(group + ":" + column); !added) return added;
    }
    const auto add_shadows_of = [&](const std::string& name,
                                    const std::string& as) -> Result<void> {
        const auto groups = names_.groups(as);
        if (!groups) return groups.error();
        json numbers = json::array();
        for (size_t s = 0; s < rows_.shadows.size(); ++s)
            if ((*groups)[names_.group_of(rows_.shadows[s])]) numbers.push_back(s);
        shadows[name] = std::move(numbers);
        return {};
    };
    for (const std::string& group : rows_.shadows)
        if (auto added = add_shadows_of(group, group); !added) return added;
    for (size_t i = 0; i < rows_.casters.size(); ++i) casters[rows_.casters[i]] = json::array({i});
    for (const Control& c : look_.controls) {
        if (is_shadow_word(c, names_)) {
            if (auto added = add_shadows_of("shadow", "all"); !added) return added;
        } else if (c.kind == Kind::Shadow) {
            if (auto added = add_shadows_of(c.target, c.target); !added) return added;
        } else if (c.kind == Kind::Caster) {
            const auto layers = names_.caster_layers(c.target);
            if (!layers) return layers.error();
            json numbers = json::array();
            for (size_t i = 0; i < made_.data["casters"].size(); ++i) {
                const size_t plane = made_.data["casters"][i]["plane"];
                if (std::find(layers->begin(), layers->end(), made_.layers[plane]) != layers->end())
                    numbers.push_back(i);
            }
            casters[c.target] = std::move(numbers);
        } else if (c.kind != Kind::Clamp) {
            if (auto added = add_cells(c.target); !added) return added;
        }
    }
    made_.data["targets"] = {{"cells", std::move(cells)},
                             {"shadows", std::move(shadows)},
                             {"casters", std::move(casters)}};
    return {};
}

void RowsMaker::add_names() {
    json lights = json::array(), bounces = json::array(), lobes = json::array();
    const auto notes = [&](const std::string& name) {
        std::string prims;
        for (const accumulate::LightGroup& light : stack_.header().lights) {
            if (light.name != name) continue;
            for (const std::string& prim : light.prims) prims += (prims.empty() ? "" : ", ") + prim;
        }
        return prims;
    };
    for (const std::string& name : rows_.lights) {
        json row = row_of(name);
        row["note"] = notes(name);
        row["isMaster"] = (name == "all" || name == "env") && !names_.is_row(name);
        lights.push_back(std::move(row));
        if (name != "all") continue;
        // Masters of the look's own
        for (const auto& [set, list] : look_.rows) {
            json master = row_of(set);
            master["note"] = fmt::format("{}", fmt::join(list, ", "));
            master["isMaster"] = true;
            lights.push_back(std::move(master));
        }
    }
    for (const std::string& name : rows_.bounces) {
        json row = row_of(name);
        row["isMaster"] = name == "direct" || name == "indirect";
        bounces.push_back(std::move(row));
    }
    for (const std::string& name : rows_.lobes) lobes.push_back(row_of(name));
    made_.data["lights"] = std::move(lights);
    made_.data["bounces"] = std::move(bounces);
    made_.data["lobes"] = std::move(lobes);
    const std::string family = made_.data["families"][0]["name"];
    const bool has_grid = family == "matrix" || family == "lobe-matrix";
    made_.data["grid"] = {{"groups", has_grid ? rows_.groups : std::vector<std::string>()},
                          {"columns", has_grid ? rows_.columns : std::vector<std::string>()}};
    made_.data["cells"] = names_.cell_count();
}

Result<void> RowsMaker::add_look() {
    const auto color = color_of_stack(stack_, look_);
    if (!color) return color.error();
    const image::ColorMatrix matrix = image::file_from_rec709(*color);
    json controls = json::array();
    for (const Control& c : look_.controls) {
        json control = {{"do", name_of(c.kind)}, {"name", c.target}};
        if (!c.value.empty()) control["value"] = value_of(c);
        control["factor"] = c.kind == Kind::Kelvin ? kelvin_tint(c.kelvin, matrix) : c.factor;
        if (c.kind == Kind::Kelvin) control["kelvin"] = c.kelvin;
        controls.push_back(std::move(control));
    }
    made_.data["look"] = {{"controls", std::move(controls)},
                          {"exposure", look_.exposure_stops},
                          {"display", look_.display},
                          {"view", look_.view},
                          {"rows", look_.rows}};
    made_.data["fileFromRec709"] = matrix;
    return {};
}

Result<void> RowsMaker::check_look() const {
    for (const Control& c : look_.controls) {
        if (!c.matte.empty())
            return Error{"export-matte", fmt::format("the page has no mattes: {} acts within {}",
                                                     c.target, c.matte)};
        if (c.kind == Kind::Clamp && c.factor[0] > 0.0f)
            return Error{"export-clamp",
                         fmt::format("the page cannot undo clamps: remove --clamp {}", c.target)};
    }
    return {};
}

Result<WebRows> RowsMaker::run(const std::string& family) {
    if (auto checked = check_look(); !checked) return checked.error();
    // That the look can be mixed at all, and by one of the families that the page has
    const auto plan = mix::plan_mix(stack_, look_);
    if (!plan) return plan.error();
    if (auto added = add_families(family, needs_lobes(plan->faders)); !added) return added.error();
    const auto& families = made_.data["families"];
    const auto gains = gains_of(plan->faders);
    const bool is_there = std::any_of(families.begin(), families.end(),
                                      [&](const json& f) { return can_express(f, gains); });
    if (!is_there)
        return Error{"mix-not-stored",
                     fmt::format("the look has gains that --layers {} cannot express", family)};
    if (auto added = add_shadows(); !added) return added.error();
    if (auto added = add_targets(); !added) return added.error();
    add_names();
    if (auto added = add_look(); !added) return added.error();
    return std::move(made_);
}

}  // namespace

Result<WebRows> web_rows(const LayerStack& stack, const Look& look, const std::string& family) {
    return RowsMaker(stack, look).run(family);
}

}  // namespace velatura::compositor::exports
