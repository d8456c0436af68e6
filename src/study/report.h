// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "study/statistics.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::study {

/// What a study was of.
struct Subject {
    std::string scene, build, machine, date;
    int width = 0, height = 0;  ///< of the image
    uint64_t spp = 64, seed = 0;
    int threads = 1;
    std::string options;  ///< as typed
};

/// Noise at a number of samples.
struct CurvePoint {
    uint64_t spp = 0;
    double cpu_s = 0;  ///< of the whole image
    Estimate noise;    ///< relative
};

enum class Verdict : uint8_t {
    Unknown,        ///< not enough rounds
    Now,            ///< the render as it is
    MostEfficient,  ///< lowers the error at equal time, more than any other
    Better,         ///< lowers the error at equal time
    Cheaper,        ///< the same error for less time
    NoDifference,   ///< none is seen
    Worse,          ///< a larger error at equal time
    Suspect,        ///< promises the mean of the render as it is and has another
    Changes,        ///< another image or file, by intent; see its bias
};

const char* text_of(Verdict verdict);

/// What one setting came to. Errors are relative (1 = 100 %), times CPU seconds of the whole
/// image.
struct SettingResult {
    Setting setting;
    int rounds = 0;
    std::string rejection;
    std::vector<CurvePoint> curve;
    Estimate noise;    ///< at the render's samples
    double bias = 0;   ///< of everything that this setting leaves out, other knobs as they are
    double error = 0;  ///< noise and bias together
    DifferenceTest difference;  ///< from its anchor; of an anchor from the render as it is
    double cpu_s = 0, setup_s = 0, rays_per_sample = 0;
    double outline_px =
        0;  ///< how far outlines of subdivision surfaces are off, in pixels; 0: there are none
    Estimate time;        ///< over that of the render as it is
    Estimate equal_time;  ///< error after the time that the render as it is takes, over its error;
                          ///< high with the bias that may hide
    Slope slope;
    Verdict verdict = Verdict::Unknown;
};

/// A line of the table.
struct KnobRow {
    std::string knob, now;
    double bias = 0;  ///< that the present value leaves
    bool is_biased = false;
    double cost_share = 0;  ///< of the time, over that of the knob.s cheapest value
    size_t next = 0;        ///< the setting that is worth a look; 0: there is none
    double buys = 0;        ///< change of the error at the same samples
    double costs_s = 0;     ///< change of the time
    Verdict verdict = Verdict::Unknown;
    std::string advice;
};

struct LayerRow {
    bool is_bounce = false;
    std::string name;
    double energy = 0;  ///< share of the image's
    double noise =
        0;  ///< share of the squared error; rows make up for one another, and need not add up to 1
};

/// An image of the grid, for people to look at.
struct StudyMap {
    std::string name, caption;
    std::vector<float> rgb;  ///< display-referred, [height][width][3]
};

/// A part of the image by one setting, rendered for the same time as by the others.
struct ShownImage {
    std::string name, caption;
    int width = 0, height = 0;
    std::vector<float> rgb;  ///< display-referred, [height][width][3]
};

/// A way of storing the image with its layers.
struct FileFormat {
    std::string options;
    double bytes = 0, write_s = 0;  ///< of the whole image; CPU seconds
    double error = 0;               ///< relative, that rounding adds to the beauty
    bool is_now = false;
};

struct Report {
    Subject subject;
    Grid grid;
    int rounds = 0;
    double elapsed_s = 0;
    double bias = 0, error = 0;  ///< of the render as it is
    Estimate noise;
    double half_error = 0;  ///< relative error that storing half floats adds
    double concentration = 0,
           time_concentration =
               0;  ///< share of the pixels that carry half of the error; of the time
    std::vector<SettingResult> settings;
    std::vector<KnobRow> rows;  ///< by what they are worth
    std::vector<LayerRow> layers;
    std::vector<StudyMap> maps;
    std::vector<ShownImage> images;
    std::vector<FileFormat> files;
};

/// Estimates everything from what there is.
Report make_report(const Subject& subject,
                   const std::vector<Knob>& knobs,
                   const Facts& facts,
                   const std::vector<Setting>& settings,
                   const Tallies& tallies);

/// Settings that need no further rounds: worse beyond doubt, of the same image in about the same
/// time, or of another image by intent, which nobody weighs.
std::vector<bool> settled_settings(const Subject& subject,
                                   const std::vector<Setting>& settings,
                                   const Tallies& tallies);

std::string to_json(const Report& report);
std::string to_csv(const Report& report);
/// One page with everything in it; light and dark, for screens and paper.
std::string to_html(const Report& report);
/// The table, for a terminal.
std::string to_text(const Report& report);

}  // namespace velatura::study
