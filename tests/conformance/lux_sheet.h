// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lux_forms.h"
#include "usd/stage/stage.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace velatura::test {

/// One file of luxtest with its entry in light_descriptions.json: a light whose parameters vary
/// from frame to frame.
class LuxSheet {
  public:
    LuxSheet(const std::string& name, const nlohmann::json& description);

    const std::string& name() const { return name_; }

    const usd::stage::Stage& stage() const { return stage_; }

    usd::stage::Prim light_prim() const { return light_; }

    /// All frames of the sheet, in order.
    std::vector<int> frames() const;

    double number(const char* name, double otherwise, double frame) const {
        return light_.attribute(name).get_or<double>(otherwise, frame);
    }

    std::string ies_file(double frame) const {
        return light_.attribute("inputs:shaping:ies:file").get_or<std::string>("", frame);
    }

    /// What the light's attributes say at a frame.
    LuxLight light(double frame) const;

    /// Expects that what the suite's own description says of each frame is what the stage says.
    void expect_described_values() const;

  private:
    void expect_value(int frame, const std::string& attribute, const nlohmann::json& value) const;

    std::string name_;
    nlohmann::json description_;
    usd::stage::Stage stage_;
    usd::stage::Prim light_;
};

}  // namespace velatura::test
