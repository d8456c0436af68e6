// SPDX-License-Identifier: Apache-2.0
#include "study/knobs.h"

#include <algorithm>

namespace velatura::study {

namespace {

/// One line for each knob, one entry for each value.
const std::vector<Knob>& all_knobs() {
    constexpr BiasClass same = BiasClass::Unbiased, off = BiasClass::Biased,
                        other = BiasClass::Changes;
    static const std::vector<Knob> knobs = {
        {"max bounces",
         "--max-depth",
         {{"0"}, {"1", off}, {"2", off}, {"4", off}, {"8", off}, {"16", off}},
         "0"},
        {"path ending",
         "--roulette",
         {{"efficiency"}, {"throughput"}, {"albedo"}, {"constant"}, {"cutoff", off}},
         "efficiency"},
        {"light sampling",
         "--light-sampling",
         {{"mis"},
          {"light", same, true},
          {"area", same, true},
          {"global-area", same, true},
          {"hemisphere", same, true},
          {"cosine", same, true},
          {"bsdf", same, true}}},
        {"integrator", "--integrator", {{"path"}, {"whitted", off}}, "path"},
        {"light selection",
         "--light-selection",
         {{"tree"}, {"power"}, {"area"}, {"uniform"}},
         "",
         "several lights"},
        {"sampler", "--sampler", {{"sobol"}, {"blue-noise"}, {"stratified"}, {"independent"}}},
        {"adaptive", "--adaptive", {{"on"}, {"off"}}},
        {"splitting", "--splitting", {{"auto"}, {"off"}}},
        {"guiding", "--guiding", {{"auto"}, {"on"}, {"off"}}},
        {"caustics",
         "--caustics",
         {{"auto"}, {"path"}, {"light"}, {"manifold"}},
         "",
         "casters of caustics"},
        {"pixel filter",
         "--filter",
         {{"blackman-harris", other},
          {"box", other},
          {"triangle", other},
          {"gaussian", other},
          {"mitchell", other}}},
        {"BVH quality", "--bvh-quality", {{"auto"}, {"fast"}, {"balanced"}, {"high"}}},
        {"texture bias",
         "--texture-bias",
         {{"-8"}, {"-2", off}, {"-1", off}, {"0", off}, {"1", off}, {"2", off}},
         "-8",
         "textures"},
        {"volume bounds", "--volume-bounds", {{"bricks"}, {"one"}}, "", "volumes"},
        {"dicing rate",
         "--dicing-rate",
         {{"0.5"}, {"1", off}, {"2", off}, {"4", off}},
         "0.5",
         "subdivision by rate"},
        {"subdivision level",
         "--subdivision-level",
         {{"6"}, {"5", off}, {"4", off}, {"3", off}, {"2", off}, {"1", off}},
         "6",
         "subdivision by level"},
        {"light layers",
         "--layers",
         {{"bounce,light,matrix,shadow,data", other}, {"bounce,light", other}, {"none", other}}},
    };
    return knobs;
}

bool is_chosen(const Knob& knob, const std::set<std::string>& only) {
    return only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& name) {
               return is_name_of(name, knob);
           });
}

std::string value_now(const Knob& knob, const Facts& facts) {
    const auto found = facts.now.find(knob.option);
    return found == facts.now.end() ? std::string() : found->second;
}

/// Effects are knobs with two values. What already is left out comes along.
Knob effect_knob(const std::string& effect, const std::string& omitted) {
    return {"effect " + effect,
            "--effects",
            {{omitted, BiasClass::Changes},
             {(omitted.empty() ? "-" : omitted + ",-") + effect, BiasClass::Changes}}};
}

}  // namespace

bool is_name_of(const std::string& name, const Knob& knob) {
    return name == knob.name || name == knob.option || name == knob.option.substr(2);
}

std::vector<Knob> knobs_for(const Facts& facts, const std::set<std::string>& only) {
    std::vector<Knob> chosen;
    for (const Knob& knob : all_knobs()) {
        if (!knob.needs.empty() && !facts.holds.contains(knob.needs)) continue;
        if (!facts.now.contains(knob.option) || !is_chosen(knob, only)) continue;
        Knob k = knob;
        // A value that nobody thought of is as good as the least of those listed
        const std::string now = value_now(knob, facts);
        if (std::none_of(k.values.begin(), k.values.end(),
                         [&](const KnobValue& v) { return v.text == now; }))
            k.values.push_back({now, k.values.back().bias_class});
        chosen.push_back(std::move(k));
    }
    const auto omitted = facts.now.find("--effects");
    for (const std::string& effect : facts.effects) {
        Knob k = effect_knob(effect, omitted == facts.now.end() ? "" : omitted->second);
        if (is_chosen(k, only)) chosen.push_back(std::move(k));
    }
    return chosen;
}

std::vector<Setting> settings_for(const std::vector<Knob>& knobs, const Facts& facts) {
    std::vector<Setting> settings = {{.knob = {}, .value = {}, .options = {}, .is_now = true}};
    std::map<std::string, size_t> exact_of;
    const auto add = [&](const Knob& k, const KnobValue& v, size_t anchor) {
        const std::string now = value_now(k, facts);
        const bool misses_rare_light_now =
            std::any_of(k.values.begin(), k.values.end(),
                        [&](const KnobValue& w) { return w.text == now && w.misses_rare_light; });
        settings.push_back({k.name, v.text, k.option + " " + v.text, v.bias_class, false,
                            v.misses_rare_light, misses_rare_light_now, anchor});
    };

    // What others are held against comes first in every round
    for (const Knob& k : knobs) {
        const std::string now = value_now(k, facts);
        if (k.exact.empty() || k.exact == now) continue;
        for (const KnobValue& v : k.values) {
            if (v.text != k.exact) continue;
            exact_of[k.name] = settings.size();
            add(k, v, settings.size());
        }
    }
    for (const Knob& k : knobs) {
        const std::string now = value_now(k, facts);
        const auto exact = exact_of.find(k.name);
        const size_t anchor = exact == exact_of.end() ? 0 : exact->second;
        for (const KnobValue& v : k.values)
            if (v.text != now && !(anchor != 0 && v.text == k.exact)) add(k, v, anchor);
    }
    return settings;
}

}  // namespace velatura::study
