// SPDX-License-Identifier: Apache-2.0
#include "plugins/hydra/camera_prim.h"

#include <pxr/base/gf/camera.h>
#include <pxr/imaging/hd/sceneDelegate.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace velatura::hydra {

using namespace PXR_NS;
using usd::layer::Value;
using usd::layer::Vec2f;

namespace {

/// Tenths of scene units, as USD has them, of scene units, as Hydra does. The number that was
/// authored is the shortest one that gives the product.
float in_tenths(float units) {
    const auto unit = float(GfCamera::APERTURE_UNIT);
    for (int digits = 1; digits <= 9; ++digits) {
        char text[32];
        std::snprintf(text, sizeof text, "%.*g", digits, double(units) / double(unit));
        const float tenths = std::strtof(text, nullptr);
        if (tenths * unit == units) return tenths;
    }
    return units / unit;
}

/// As USD has them.
constexpr std::array own_attributes = {
    "velatura:lens:blades", "velatura:lens:rotation", "velatura:lens:roundness", "exposure:time",
    "exposure:iso",         "exposure:fStop",         "exposure:responsivity"};

}  // namespace

void CameraPrim::Sync(HdSceneDelegate* delegate, HdRenderParam* param, HdDirtyBits* dirty_bits) {
    const bool is_changed = (*dirty_bits & AllDirty) != 0;
    HdCamera::Sync(delegate, param, dirty_bits);
    if (!is_changed) return;
    ++version_;
    prim_ = AuthoredPrim("Camera");
    prim_.set_transform(GetTransform(), true);
    prim_.set_token("projection", GetProjection() == Orthographic ? "orthographic" : "perspective");
    const auto set = [this](const char* name, float value) {
        prim_.set(name, "float", Value(value));
    };
    set("horizontalAperture", in_tenths(GetHorizontalAperture()));
    set("verticalAperture", in_tenths(GetVerticalAperture()));
    set("horizontalApertureOffset", in_tenths(GetHorizontalApertureOffset()));
    set("verticalApertureOffset", in_tenths(GetVerticalApertureOffset()));
    set("focalLength", in_tenths(GetFocalLength()));
    set("fStop", GetFStop());
    set("focusDistance", GetFocusDistance());
    set("exposure", GetExposure());
    const GfRange1f range = GetClippingRange();
    if (!range.IsEmpty())
        prim_.set("clippingRange", "float2", Value(Vec2f(range.GetMin(), range.GetMax())));
    for (const char* const name : own_attributes)
        prim_.set(name, delegate->GetCameraParamValue(GetId(), TfToken(name)));
}

}  // namespace velatura::hydra
