// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/pixel_shares.h"

#include "compositor/look/look_rows.h"
#include "compositor/window/tile_mix.h"

#include <algorithm>

namespace velatura::compositor::window {

namespace {

bool is_master(const std::string& row) {
    return row == "all" || row == "env";
}

}  // namespace

double PixelShares::of(const std::string& row) const {
    const auto at = shares.find(row);
    return at == shares.end() ? 0 : at->second;
}

std::vector<std::string> PixelShares::sorted(std::vector<std::string> rows) const {
    std::stable_sort(rows.begin(), rows.end(), [&](const std::string& a, const std::string& b) {
        if (is_master(a) != is_master(b)) return is_master(a);
        return !is_master(a) && of(a) > of(b);
    });
    return rows;
}

PixelShares shares_at(const LayerStack& stack,
                      const Look& look,
                      const std::vector<std::string>& rows,
                      const std::array<int, 2>& pixel,
                      const std::function<Result<mix::MixPlan>(const Look&)>& plan) {
    Look whole = look;
    std::erase_if(whole.controls, [](const Control& c) { return c.kind == Control::Kind::Solo; });
    const image::Window tile = {pixel[0], pixel[1], pixel[0] + 1, pixel[1] + 1};
    const auto light_of = [&](const Look& mixed) {
        const auto planned = plan(mixed);
        if (!planned) return 0.0;
        const std::vector<float> rgb = mix_tile(stack, *planned, 0, tile);
        return 0.2126 * double(rgb[0]) + 0.7152 * double(rgb[1]) + 0.0722 * double(rgb[2]);
    };
    PixelShares out;
    out.pixel = pixel;
    const double sum = light_of(whole);
    for (const std::string& row : rows) {
        Look alone = whole;
        set_soloed(alone, row, true);
        out.shares[row] = sum > 0 ? light_of(alone) / sum : 0;
    }
    return out;
}

}  // namespace velatura::compositor::window
