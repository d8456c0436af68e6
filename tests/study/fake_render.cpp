// SPDX-License-Identifier: Apache-2.0
#include "study/fake_render.h"

#include "base/hash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace velatura::test {

Result<study::RenderRun> FakeRenderer::operator()(const study::RenderRequest& request) {
    ++calls;
    const auto found = settings.find(request.options);
    const FakeSetting s = found == settings.end() ? FakeSetting{} : found->second;
    const size_t pixels = request.grid.pixels();
    study::RenderRun run;
    run.setup_s = s.setup_s;
    // The same image: the numbers of the render as it is
    std::mt19937_64 numbers(
        hash_combine(request.seed, hash_string(s.is_same ? std::string() : request.options)));
    std::mt19937_64 times(hash_combine(request.seed + 1, hash_string(request.options)));
    std::normal_distribution<double> normal;
    const double slow = (1 + machine_drift * double(request.seed % 2)) *
                        std::exp(0.1 * std::normal_distribution<double>()(times));
    for (const uint64_t spp : request.spp) {
        study::Reading r{.spp = spp, .means = {}};
        const double ratio = double(spp) / 64;
        for (size_t p = 0; p < pixels; ++p) {
            const double at = double(p) / double(pixels);
            for (int c = 0; c < 3; ++c) {
                const double mean = 0.2 + at + 0.1 * c,
                             tilt = at < 0.5 ? s.tilt * 0.7 : -s.tilt * 0.7;
                const double sigma = noise * s.noise * (0.5 + at) * std::pow(ratio, s.slope) *
                                     std::sqrt(mean * mean + 0.01);
                r.means.push_back(float(mean * s.scale + tilt + sigma * normal(numbers)));
            }
        }
        r.cpu_s = cpu_s * s.time * ratio * slow;
        r.rays = spp * pixels * 5;
        run.readings.push_back(std::move(r));
    }
    run.pixel_s.assign(pixels, 1e-4f);
    run.layers.push_back({true, "b1", run.readings.back().means});
    return run;
}

FakeStudy::FakeStudy(std::vector<study::Knob> k) : knobs(std::move(k)) {
    for (const study::Knob& knob : knobs) facts.now[knob.option] = knob.values.front().text;
    facts.spp = subject.spp = options.spp = 64;
    subject.scene = "fake.usda";
    subject.width = options.width = 480;
    subject.height = options.height = 320;
    options.rounds = 12;
    options.time_s = 600;
    settings = study::settings_for(knobs, facts);
    tallies.grid = {48, 32};
}

study::Report FakeStudy::run(FakeRenderer& renderer) {
    const Result<void> done =
        study::run_experiments(settings, options, std::ref(renderer), {}, tallies);
    EXPECT_TRUE(done.has_value());
    return study::make_report(subject, knobs, facts, settings, tallies);
}

const study::SettingResult& result_of(const study::Report& report,
                                      const std::string& knob,
                                      const std::string& value) {
    for (const study::SettingResult& r : report.settings)
        if (r.setting.knob == knob && r.setting.value == value) return r;
    ADD_FAILURE() << "no setting " << knob << ' ' << value;
    return report.settings.front();
}

}  // namespace velatura::test
