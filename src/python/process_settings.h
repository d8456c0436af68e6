// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/asset_options.h"

#include <memory>
#include <string>
#include <utility>

namespace velatura::python {

/// Where assets can lie and how much they can take (asset_root, confine, sandbox, limit) are
/// settings of the process, which every reader asks. A lease keeps those of one scene in force: as
/// long as it lives, only scenes with the same ones are opened.
class ProcessSettings {
  public:
    /// Throws: Failure "process-settings" where a stage or renderer that is alive has others.
    static std::shared_ptr<const ProcessSettings> lease(const std::string& scene,
                                                        const app::AssetOptions& assets);

    ProcessSettings(const ProcessSettings&) = delete;
    ProcessSettings& operator=(const ProcessSettings&) = delete;

  private:
    explicit ProcessSettings(std::string content) : content_(std::move(content)) {}

    const std::string content_;  ///< what two leases have alike
};

}  // namespace velatura::python
