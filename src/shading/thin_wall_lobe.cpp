// SPDX-License-Identifier: Apache-2.0
#include "shading/thin_wall_lobe.h"

#include "shading/fresnel.h"
#include "shading/rgb_math.h"

#include <algorithm>
#include <cmath>

namespace velatura::shading {

Rgb ThinWallLobe::passage(float cosine) const {
    if (!has_tint) return Rgb(1.0f);
    const float inside = refracted_cosine(cosine, ior);
    if (!(inside > 0.0f)) return Rgb(0.0f);
    return {std::pow(tint.x, 1.0f / inside), std::pow(tint.y, 1.0f / inside),
            std::pow(tint.z, 1.0f / inside)};
}

void ThinWallLobe::set_compensation(const Rgb& f_average, float average_loss) {
    // Of a diffuse field
    constexpr float mean_cosine = 2.0f / 3.0f;
    const SheetShares once = sheet_shares(f_average, passage(mean_cosine));
    const Rgb kept = once.reflected + once.transmitted;
    const Rgb factor = safe_divide(multiple_scattering_fresnel(kept, average_loss), kept);
    multiple = {once.reflected * factor, once.transmitted * factor};
}

void ThinWallLobe::set_view(LayerView& v) const {
    const SheetShares shares = sheet_shares(v.specular, passage(v.mu));
    v.reflected = v.specular + (shares.reflected - v.specular) * (1.0f - opacity);
    v.through = shares.transmitted;
    v.single_scatter = v.reflected * (1.0f - v.loss);
}

float ThinWallLobe::reflect_share(const GgxLobe& ggx, float cos_m) const {
    const Rgb fresnel = ggx.fresnel(cos_m);
    const SheetShares sheet = sheet_shares(fresnel, passage(cos_m));
    const float through = (1.0f - opacity) * mean(sheet.transmitted);
    const float reflected = opacity * mean(fresnel) + (1.0f - opacity) * mean(sheet.reflected);
    return reflected + through > 0.0f ? reflected / (reflected + through) : 1.0f;
}

void ThinWallLobe::add_through(const GgxLobe& ggx,
                               const LayerView& v,
                               const Vec3& mirrored,
                               float mu_i,
                               float loss_i,
                               BsdfValue& value) const {
    const float share = 1.0f - opacity;
    Vec3 wm = v.wo + mirrored;
    const float length2 = wm.dot(wm);
    wm = length2 > 0.0f ? wm / std::sqrt(length2) : Vec3(0.0f);
    if (wm.z > 0.0f) {
        const float cos_m = std::clamp(v.wo.dot(wm), 0.0f, 1.0f);
        const SheetShares sheet = sheet_shares(ggx.fresnel(cos_m), passage(cos_m));
        value.specular +=
            sheet.transmitted * (share * ggx.d(wm) * ggx.visibility(v, mirrored, mu_i));
        value.pdf += v.probability[Sheet] * (1.0f - reflect_share(ggx, cos_m)) * ggx.pdf(v.wo, wm);
    }
    if (ggx.average_loss > 0.0f)
        value.specular +=
            multiple.transmitted * (share * v.loss * loss_i * inv_pi / ggx.average_loss);
}

Vec3 ThinWallLobe::sample(const GgxLobe& ggx,
                          const LayerView& v,
                          float u_choice,
                          const Vec2& u) const {
    Vec3 wi = ggx.sample(v.wo, u);
    if (!(wi.z > 0.0f)) return Vec3(0.0f);
    const Vec3 across = v.wo + wi;
    const float cos_m = std::min(0.5f * std::sqrt(across.dot(across)), 1.0f);
    if (!(u_choice < reflect_share(ggx, cos_m))) wi.z = -wi.z;
    return wi;
}

}  // namespace velatura::shading
