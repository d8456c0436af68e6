// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "farm/job.h"

#include <string>
#include <vector>

namespace velatura::farm {

/// What a machine would render a job with: its file in the folder `checks` of the job.
struct MachineCheck {
    std::string node, build, processor;
    std::string features;  ///< of the processor, among those that instructions are chosen by
    std::string scene;     ///< hash of the scene's files
    std::string pixels;    ///< SHA-256 of the image
    std::string settings;  ///< JSON object: of files beside the scene, plugins, … by name
    std::string problem;   ///< why this machine cannot render it; empty: it can
};

/// Renders four samples of a tiny image of the job on this machine, and writes what it was rendered
/// with. Errors: "io-write".
Result<MachineCheck> check_machine(const Job& job, const std::string& build);

/// Of all machines that were checked. Errors: "farm-piece" (damaged file), "io-open".
Result<std::vector<MachineCheck>> read_checks(const Job& job);

/// Features of processors that not all machines have, a line for each machine without some; images
/// do not depend on them, or their pixels would differ.
std::vector<std::string> differing_processors(const std::vector<MachineCheck>& checks);

/// Why the machines cannot share the job, a line for each that differs from most of them or cannot
/// render; empty: they can.
std::vector<std::string> differing_machines(const Job& job,
                                            const std::vector<MachineCheck>& checks);

}  // namespace velatura::farm
