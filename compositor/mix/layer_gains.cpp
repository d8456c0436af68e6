// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layer_gains.h"

#include "base/tasks.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace velatura::compositor::mix {

using accumulate::LayerEntry;
using image::Channel;

/// The operations of a mix without layers, in its order.
Values LayerGains::gained(const MixPlan::Term& term, const Values& values, size_t c) const {
    const float gain = term.gain[c] * plan_.exposure;
    const bool is_matted = has_mattes(term);
    Values to(values.size());
    for (size_t i = 0; i < to.size(); ++i)
        to[i] = gain * (is_matted ? values[i] * plan_.mix.matte_factor(term, c, i) : values[i]);
    return to;
}

/// Stored ones, in the order in which they add up.
std::vector<std::string> LayerGains::casters_of(const LayerEntry& shadow) const {
    std::vector<std::string> casters;
    for (const LayerEntry& e : plan_.layout.header().layers) {
        if (shadow.family == "shadow" && e.family == "caster" && e.group == shadow.group &&
            image_.has({e.name, "", 0}))
            casters.push_back(e.name);
    }
    return casters;
}

/// With what a clamp took and the direct light of lifted shadows.
void LayerGains::gain_family(const MixPlan::Term& term, const LayerChannel& own) {
    Values* const values = image_.values(own);
    if (!values) return;
    Values whole = *values;
    if (!term.clamp_layer.empty()) {
        if (const Values* taken = image_.values({term.clamp_layer, own.half, own.c})) {
            for (size_t i = 0; i < whole.size(); ++i)
                whole[i] += plan_.mix.clamp_share(term, i) * (*taken)[i];
        }
    }
    whole = gained(term, whole, own.c);
    for (const MixPlan::Term& shadow : plan_.mix.shadow_terms) {
        if (shadow.direct_layer != term.layer) continue;
        const Values* blocked = image_.values({shadow.layer, own.half, own.c});
        if (!blocked) continue;
        const Values lifted = gained(shadow, *blocked, own.c);
        for (size_t i = 0; i < whole.size(); ++i) whole[i] += lifted[i];
    }
    *values = std::move(whole);
}

/// Less what was lifted of it.
void LayerGains::gain_shadow(const LayerEntry& shadow, const LayerChannel& own) {
    Values& values = *image_.values(own);
    Values left = gained(*plan_.beside(shadow.name), values, own.c);
    for (const MixPlan::Term& term : plan_.mix.shadow_terms) {
        const LayerEntry* of = plan_.layout.header().find(term.layer);
        const bool is_of_group =
            shadow.family == "caster" && of->family == "shadow" && of->group == shadow.group;
        if (term.layer != shadow.name && !is_of_group) continue;
        const Values lifted = gained(term, values, own.c);
        for (size_t i = 0; i < left.size(); ++i) left[i] -= lifted[i];
    }
    values = std::move(left);
}

/// Less what was given back of it.
void LayerGains::gain_clamp(const LayerEntry& clamp, const LayerChannel& own) {
    Values& values = *image_.values(own);
    for (const MixPlan::Term& term : plan_.terms) {
        if (term.clamp_layer != clamp.name) continue;
        for (size_t i = 0; i < values.size(); ++i)
            values[i] -= plan_.mix.clamp_share(term, i) * values[i];
    }
    values = gained(*plan_.beside(clamp.name), values, own.c);
}

/// Layers with a gain of their own, and those that follow the gain of all light.
void LayerGains::gain_beside() {
    image_.for_each({LayerOutcome::Beside}, [&](const LayerEntry& e, const LayerChannel& own) {
        Values& values = *image_.values(own);
        values = gained(*plan_.beside(e.name), values, own.c);
    });
    image_.for_each({LayerOutcome::Uniform}, [&](const LayerEntry& e, const LayerChannel& own) {
        Values& values = *image_.values(own);
        values = gained({e.name, *plan_.mix.common_gain}, values, own.c);
    });
}

void LayerGains::add_up(const std::vector<std::string>& layers, const LayerChannel& sum) {
    Values values(image_.image().data.pixel_count(), 0.0f);
    for (const std::string& layer : layers) {
        const Values* part = image_.values({layer, sum.half, sum.c});
        for (size_t i = 0; part && i < values.size(); ++i) values[i] += (*part)[i];
    }
    image_.channel(sum)->data = std::move(values);
}

void LayerGains::apply() {
    using enum LayerOutcome;
    std::vector<std::pair<const MixPlan::Term*, LayerChannel>> jobs;
    std::vector<std::string> order;
    for (const MixPlan::Term& term : plan_.terms) {
        order.push_back(term.layer);
        for (const std::string& half : plan_.halves)
            for (size_t c = 0; c < 3; ++c) jobs.push_back({&term, {term.layer, half, c}});
    }
    parallel_for(jobs.size(), [&](size_t i) { gain_family(*jobs[i].first, jobs[i].second); });
    image_.for_each({Shadow}, [&](const LayerEntry& e, const LayerChannel& own) {
        if (casters_of(e).empty()) gain_shadow(e, own);
    });
    image_.for_each({Shadow}, [&](const LayerEntry& e, const LayerChannel& own) {
        const auto casters = casters_of(e);
        if (!casters.empty()) add_up(casters, own);
    });
    gain_beside();
    image_.for_each({Clamp},
                    [&](const LayerEntry& e, const LayerChannel& own) { gain_clamp(e, own); });
    image_.for_each({Sum}, [&](const LayerEntry& e, const LayerChannel& own) {
        add_up(plan_.sources_of(e), own);
    });
    if (plan_.mix.family == "beauty") return;
    image_.for_each({Beauty}, [&](const LayerEntry&, const LayerChannel& own) {
        const auto outcome = plan_.outcomes.find(own.full_name());
        if (outcome == plan_.outcomes.end() || outcome->second != Same) add_up(order, own);
    });
    // A header that does not name the beauty
    for (size_t c = 0; c < 3 && !plan_.outcomes.count("rgba"); ++c) add_up(order, {"rgba", "", c});
}

std::array<Values, 3> LayerGains::apply_to_rows() {
    std::array<Values, 3> mixed;
    parallel_for(3, [&](size_t c) {
        mixed[c].assign(image_.image().data.pixel_count(), 0.0f);
        for (const MixPlan::Term& term : plan_.terms) {
            const Values* of = image_.values({term.layer, "", c});
            if (!of) continue;
            const Values part = gained(term, *of, c);
            for (size_t i = 0; i < part.size(); ++i) mixed[c][i] += part[i];
        }
    });
    gain_beside();
    if (!plan_.layout.has_beauty()) return mixed;
    for (size_t c = 0; c < 3; ++c)
        if (Values* const beauty = image_.values({"rgba", "", c})) *beauty = std::move(mixed[c]);
    return {};
}

void LayerGains::set_variance() {
    const auto outcome = plan_.outcomes.find("variance");
    Channel* variance = nullptr;
    for (image::Part& part : image_.image().parts) {
        for (Channel& c : part.channels)
            if (c.name == "variance") variance = &c;
    }
    if (!variance || outcome == plan_.outcomes.end() || outcome->second != LayerOutcome::Variance)
        return;
    Values now = floats_of(*variance);
    if (const auto& common = plan_.mix.common_gain) {
        const double gain = double((*common)[0]) * double(plan_.exposure);
        for (float& v : now)
            v = float(std::min(double(v) * gain * gain, double(std::numeric_limits<float>::max())));
    } else {
        for (size_t c = 0; c < 3; ++c) {
            const Values *a = image_.values({"rgba", "_hA", c}),
                         *b = image_.values({"rgba", "_hB", c});
            for (size_t i = 0; i < now.size(); ++i) {
                const double d = a && b ? double((*a)[i]) - double((*b)[i]) : 0;
                now[i] = (c == 0 ? 0.0f : now[i]) + float(d * d / 12.0);
            }
        }
    }
    variance->data = std::move(now);
}

}  // namespace velatura::compositor::mix
