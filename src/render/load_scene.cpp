// SPDX-License-Identifier: Apache-2.0
#include "render/load_scene.h"

#include "render/volume_loading.h"

namespace velatura::render {

Result<scene::Scene> load_scene(const std::string& path,
                                const LoadOptions& options,
                                Diagnostics& diagnostics) {
    const Result<usd::stage::Stage> stage = usd::stage::Stage::open(path, {}, diagnostics);
    if (!stage) return stage.error();
    return load_scene(*stage, options, diagnostics);
}

Result<scene::Scene> load_scene(const usd::stage::Stage& stage,
                                const LoadOptions& options,
                                Diagnostics& diagnostics) {
    translate::TranslateOptions of_frame = options.translate;
    of_frame.time = options.frame.value_or(stage.start_time_code());
    Result<scene::Scene> scene = translate::translate_stage(stage, of_frame, diagnostics);
    if (scene) load_volumes(*scene, options.volume_gb, diagnostics);
    return scene;
}

}  // namespace velatura::render
