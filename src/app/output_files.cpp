// SPDX-License-Identifier: Apache-2.0
#include "app/output_files.h"

#include "app/exit_codes.h"
#include "base/atomic_file.h"
#include "base/input_guard.h"
#include "film/deep_film.h"

#include <fmt/format.h>

#include <utility>

namespace velatura::app {

namespace {

int take_output(const std::string& path, std::vector<OutputLock>& locks, Diagnostics& diagnostics) {
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
    locks.push_back(std::move(*taken));
    sweep_temporaries(path);
    return Done;
}

}  // namespace

int take_outputs(const FrameInput& input,
                 std::vector<OutputLock>& locks,
                 Diagnostics& diagnostics) {
    int code = take_output(input.output, locks, diagnostics);
    for (const std::string& other : input.other_outputs)
        if (code == Done) code = take_output(other, locks, diagnostics);
    return code;
}

Result<void> check_outputs(const FrameInput& input) {
    std::vector<std::string> files = {input.output, input.stats_file,
                                      film::deep_path(input.output)};
    files.insert(files.end(), input.other_outputs.begin(), input.other_outputs.end());
    for (const std::string& file : files)
        if (auto ok = check_output(file); !ok) return ok;
    return {};
}

}  // namespace velatura::app
