// SPDX-License-Identifier: Apache-2.0
#include "app/output_files.h"

#include "app/exit_codes.h"
#include "base/atomic_file.h"
#include "base/input_guard.h"
#include "film/deep_film.h"

#include <fmt/format.h>

#include <utility>

namespace velatura::app {

int take_output(const std::string& path,
                std::optional<OutputLock>& lock,
                Diagnostics& diagnostics) {
    Result<OutputLock> taken = OutputLock::take(path);
    if (!taken) {
        diagnostics.error(taken.error().code, {}, {}, taken.error().message);
        return taken.error().code == "output-locked" ? Refused : RenderError;
    }
    if (!taken->is_held())
        diagnostics.warn("output-lock", {}, {},
                         fmt::format("file system of {} does not support locks; concurrent renders "
                                     "to it are not detected",
                                     path));
    lock.emplace(std::move(*taken));
    sweep_temporaries(path);
    return Done;
}

Result<void> check_outputs(const FrameInput& input) {
    for (const std::string& file : {input.output, input.stats_file, film::deep_path(input.output)})
        if (auto ok = check_output(file); !ok) return ok;
    return {};
}

}  // namespace velatura::app
