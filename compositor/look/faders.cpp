// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/faders.h"

#include <algorithm>

namespace velatura::compositor {
inline namespace look {

namespace {

/// How many cells of a group, or of a bounce, are selected.
size_t count(const Selection& selected, size_t first, size_t step, size_t cells) {
    size_t found = 0;
    for (size_t i = 0; i < cells; ++i) found += size_t(selected[first + i * step]);
    return found;
}

}  // namespace

std::array<float, 3> Fader::factor() const {
    if (is_muted) return {0, 0, 0};
    return {gain * tint[0], gain * tint[1], gain * tint[2]};
}

Faders::Faders(const std::vector<std::string>& columns,
               const std::vector<std::string>& group_names) {
    for (const std::string& name : columns) bounces.push_back({name});
    for (const std::string& name : group_names) groups.push_back({name});
    cells.assign(bounces.size() * groups.size(), {1, 1, 1});
}

void Faders::apply(Control::Kind kind,
                   const std::array<float, 3>& factor,
                   const Selection& selected) {
    const auto turn = [&](Fader& fader) {
        if (kind == Control::Kind::Gain)
            fader.gain *= factor[0];
        else if (kind == Control::Kind::Mute)
            fader.is_muted = true;
        else
            for (size_t c = 0; c < 3; ++c) fader.tint[c] *= factor[c];
    };
    const size_t g_count = groups.size(), b_count = bounces.size();
    if (std::all_of(selected.begin(), selected.end(), [](bool s) { return s; })) return turn(all);
    bool is_of_groups = true, is_of_bounces = true;
    for (size_t g = 0; g < g_count; ++g) {
        const size_t n = count(selected, g, g_count, b_count);
        is_of_groups = is_of_groups && (n == 0 || n == b_count);
    }
    for (size_t b = 0; b < b_count; ++b) {
        const size_t n = count(selected, b * g_count, 1, g_count);
        is_of_bounces = is_of_bounces && (n == 0 || n == g_count);
    }
    for (size_t g = 0; g < g_count && is_of_groups; ++g)
        if (selected[g]) turn(groups[g]);
    for (size_t b = 0; b < b_count && is_of_bounces && !is_of_groups; ++b)
        if (selected[b * g_count]) turn(bounces[b]);
    for (size_t i = 0; i < cells.size() && !is_of_groups && !is_of_bounces; ++i)
        for (size_t c = 0; c < 3 && selected[i]; ++c) cells[i][c] *= factor[c];
}

void Faders::mute(const Selection& selected) {
    const size_t g_count = groups.size(), b_count = bounces.size();
    for (size_t g = 0; g < g_count; ++g)
        if (count(selected, g, g_count, b_count) == b_count) groups[g].is_muted = true;
    for (size_t b = 0; b < b_count; ++b)
        if (count(selected, b * g_count, 1, g_count) == g_count) bounces[b].is_muted = true;
    for (size_t i = 0; i < cells.size(); ++i) {
        const bool is_muted = bounces[i / g_count].is_muted || groups[i % g_count].is_muted;
        if (selected[i] && !is_muted) cells[i] = {0, 0, 0};
    }
}

}  // namespace look
}  // namespace velatura::compositor
