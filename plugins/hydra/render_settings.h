// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "render/settings.h"

#include <pxr/imaging/hd/renderDelegate.h>

#include <cstdint>
#include <string>

namespace velatura::hydra {

/// What a host can set, with the defaults of `velatura render`.
struct HostSettings {
    int spp = 64;
    int seed = 0;
    int max_depth = 0;
    int bounces = 4;  ///< layers b0 … b<bounces>, tail
    std::string working_space = "lin_rec709";
    std::string caustics = "auto";
    std::string guiding = "auto";
    bool splits = true;
    bool adaptive = true;
    float clamp_direct = 0, clamp_indirect = 0;  ///< 0: none

    bool operator==(const HostSettings&) const = default;
};

/// Names, UI names and defaults.
PXR_NS::HdRenderSettingDescriptorList setting_descriptors();

/// Values that are no value of their setting are reported once, and the default is used.
HostSettings read_settings(const PXR_NS::HdRenderDelegate& delegate);

/// Without rows of light groups; layers of other families are added by those who ask for them.
render::Settings to_settings(const HostSettings& host);

}  // namespace velatura::hydra
