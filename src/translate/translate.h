// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/result.h"
#include "scene/scene.h"
#include "translate/lights/light_grouping.h"
#include "usd/stage/stage.h"

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace velatura::translate {

using lights::LightGrouping;

/// What the command line decides; empty = the stage decides.
struct TranslateOptions {
    std::string camera;    ///< prim path
    std::string settings;  ///< prim path of a RenderSettings, or of a RenderPass
    std::string pass;      ///< prim path of a RenderPass, whose renderSource yields to `settings`
    usd::stage::TimeCode time;
    /// Width, height in pixels; a height of 0 follows from the aperture of the camera.
    std::optional<std::array<int, 2>> resolution;
    std::vector<std::string> purposes;  ///< instead of the settings' includedPurposes
    std::string material_purpose;  ///< full, preview, allPurpose; instead of the settings' purposes
    std::string working_space;     ///< name of a linear space; instead of renderingColorSpace
    lights::LightGrouping light_grouping = lights::LightGrouping::PerLight;
    /// Primvars that are read whether a material reads them or not; Scene::found_primvars lists
    /// all.
    std::vector<std::string> primvars;
    /// Index among the settings' products: whose view the scene is seen by.
    size_t product = 0;
    bool finds_casters = false;  ///< fills Scene::casters
    /// Path expressions: casters are the prims that one matches, all else has none. None: by the
    /// names, models and prims of the scene.
    std::vector<std::string> casters;
    /// Instances, those nested in others counted as often as they are placed. If there are more,
    /// the prims that ask for most are left out with an error, before anything is made, until at
    /// most a million remain.
    size_t max_instances = 50'000'000;
    /// Lights, volumes and flat shapes that instances bring, each with its own, every 24 corners of
    /// a flat mesh counted as one; more is an error.
    size_t max_copies = 4'000'000;
};

/// The scene of one frame. Doubles down to the last step: world matrices are composed in double,
/// the camera's position is subtracted from their translation, then numbers are cast to float. A
/// stage moved or scaled by powers of two gives the same bits up to that scale.
///
/// Camera: `options.camera`, else the one of the product or settings, else the first of the stage,
/// else one that frames everything (a note says so). Lights: a stage without lights and without
/// emissive materials gets a white dome of radiance 1 in the group `default`. What is found and not
/// rendered gets one warning per kind and prim. Errors: "unknown-camera", "unknown-settings",
/// "unknown-pass", "bad-camera", "bad-resolution", "unknown-working-space".
Result<scene::Scene> translate_stage(const usd::stage::Stage& stage,
                                     const TranslateOptions& options,
                                     Diagnostics& diagnostics);

/// What a scene of translate_stage() with these options has at another time, about the same origin
/// and without motion blur. Messages are not repeated.
scene::Scene translate_instant(const usd::stage::Stage& stage,
                               const TranslateOptions& options,
                               double time,
                               const scene::Scene& scene);

/// Notes what translate_stage() would choose where the stage leaves it open: settings, camera, a
/// light. Makes no geometry.
void report_choices(const usd::stage::Stage& stage,
                    const TranslateOptions& options,
                    Diagnostics& diagnostics);

/// Paths of the cameras of a stage that a renderer would see, in traversal order.
std::vector<std::string> camera_paths(const usd::stage::Stage& stage);

}  // namespace velatura::translate
