// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/experiments.h"
#include "study/report.h"

#include <map>
#include <string>

namespace velatura::test {

/// What a render of one setting is made to come to.
struct FakeSetting {
    double noise = 1;      ///< over that of the render as it is
    double time = 1;       ///< over that of the render as it is
    double scale = 1;      ///< of the mean
    double tilt = 0;       ///< moves energy from one half of the pixels to the other, none is lost
    bool is_same = false;  ///< the very image of the render as it is
    double slope = -0.5;
    double setup_s = 0;
};

/// Renders by known means, noise and times: pixels of different brightness and noise, log-normal
/// time with a spread of 10 %, and a machine that is slower in some rounds.
struct FakeRenderer {
    std::map<std::string, FakeSetting> settings;  ///< by options
    double noise = 0.05;       ///< relative, of the render as it is at 64 samples
    double cpu_s = 0.01;       ///< of the grid at 64 samples
    double machine_drift = 0;  ///< how much slower odd seeds are
    int calls = 0;

    Result<study::RenderRun> operator()(const study::RenderRequest& request);
};

/// The study of an image of 480 × 320 pixels with a grid of 48 × 32 and some knobs.
struct FakeStudy {
    std::vector<study::Knob> knobs;
    study::Facts facts;
    study::Subject subject;
    study::ExperimentOptions options;
    std::vector<study::Setting> settings;
    study::Tallies tallies;

    explicit FakeStudy(std::vector<study::Knob> k);

    study::Report run(FakeRenderer& renderer);
};

const study::SettingResult& result_of(const study::Report& report,
                                      const std::string& knob,
                                      const std::string& value);

}  // namespace velatura::test
