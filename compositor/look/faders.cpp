// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/faders.h"

#include <algorithm>

namespace velatura::compositor {
inline namespace look {

namespace {

using Axis = std::vector<Fader> Faders::*;

/// In the order in which a selection is taken for rows of them.
constexpr std::array<Axis, 3> axes = {&Faders::groups, &Faders::bounces, &Faders::lobes};

/// Cells of one fader of an axis.
std::vector<size_t> cells_of(const Faders& faders, Axis axis, size_t row) {
    std::vector<size_t> cells;
    for (size_t b = 0; b < faders.bounces.size(); ++b)
        for (size_t g = 0; g < faders.groups.size(); ++g)
            for (size_t l = 0; l < faders.lobes.size(); ++l)
                if (row == (axis == &Faders::groups ? g : axis == &Faders::bounces ? b : l))
                    cells.push_back(faders.place(b, g, l));
    return cells;
}

size_t count(const Selection& selected, const std::vector<size_t>& cells) {
    return size_t(
        std::count_if(cells.begin(), cells.end(), [&](size_t i) { return bool(selected[i]); }));
}

/// The faders of an axis that a selection is made of; none where it takes parts of some.
std::vector<size_t> whole_rows(const Faders& faders, Axis axis, const Selection& selected) {
    std::vector<size_t> rows;
    for (size_t row = 0; row < (faders.*axis).size(); ++row) {
        const std::vector<size_t> cells = cells_of(faders, axis, row);
        const size_t n = count(selected, cells);
        if (n != 0 && n != cells.size()) return {};
        if (n != 0) rows.push_back(row);
    }
    return rows;
}

}  // namespace

std::array<float, 3> Fader::factor() const {
    if (is_muted) return {0, 0, 0};
    return {gain * tint[0], gain * tint[1], gain * tint[2]};
}

Faders::Faders(const std::vector<std::string>& columns,
               const std::vector<std::string>& group_names,
               const std::vector<std::string>& lobe_names) {
    for (const std::string& name : columns) bounces.push_back({name});
    for (const std::string& name : group_names) groups.push_back({name});
    for (const std::string& name : lobe_names) lobes.push_back({name});
    cells.assign(bounces.size() * groups.size() * lobes.size(), {1, 1, 1});
}

std::array<float, 3> Faders::factor(size_t column, size_t group, size_t lobe) const {
    std::array<float, 3> product = cells[place(column, group, lobe)];
    for (const Fader* fader : {&all, &groups[group], &bounces[column], &lobes[lobe]})
        for (size_t c = 0; c < 3; ++c) product[c] *= fader->factor()[c];
    return product;
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
    if (std::all_of(selected.begin(), selected.end(), [](bool s) { return s; })) return turn(all);
    for (const Axis axis : axes) {
        const std::vector<size_t> rows = whole_rows(*this, axis, selected);
        for (const size_t row : rows) turn((this->*axis)[row]);
        if (!rows.empty()) return;
    }
    for (size_t i = 0; i < cells.size(); ++i)
        for (size_t c = 0; c < 3 && selected[i]; ++c) cells[i][c] *= factor[c];
}

void Faders::mute(const Selection& selected) {
    Selection is_muted(cells.size());
    for (const Axis axis : axes) {
        for (size_t row = 0; row < (this->*axis).size(); ++row) {
            const std::vector<size_t> of_row = cells_of(*this, axis, row);
            if (count(selected, of_row) != of_row.size()) continue;
            (this->*axis)[row].is_muted = true;
            for (const size_t i : of_row) is_muted[i] = true;
        }
    }
    for (size_t i = 0; i < cells.size(); ++i)
        if (selected[i] && !is_muted[i]) cells[i] = {0, 0, 0};
}

}  // namespace look
}  // namespace velatura::compositor
