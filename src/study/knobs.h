// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace velatura::study {

/// What a value of a knob says about the image that it gives.
enum class BiasClass : uint8_t {
    Unbiased,  ///< unbiased, or the same image sooner: all its error is noise
    Biased,    ///< leaves something out of the image that the knob's exact value has
    Changes,   ///< another image, or another file of it, by intent
};

struct KnobValue {
    std::string text;  ///< as typed behind the knob's option
    BiasClass bias_class = BiasClass::Unbiased;
    bool misses_rare_light = false;  ///< meets some light so rarely that a study may see none of it
};

/// An option of a render that costs time or leaves error.
struct Knob {
    std::string name;
    std::string option;
    std::vector<KnobValue> values;
    std::string exact = {};  ///< the value that approximations are held against
    std::string needs = {};  ///< a fact without which the knob does nothing; empty = always studied
};

/// What the study is told of the scene and of the render that it is about.
struct Facts {
    std::map<std::string, std::string> now;  ///< option → value
    std::set<std::string> holds;             ///< what knobs may need
    std::vector<std::string> effects;        ///< that are on and could be left out
    uint64_t spp = 64;
};

/// Name of the knob that every other is measured by; its values are samples per pixel.
inline constexpr const char* samples_knob = "samples";

/// Whether `--knobs` means this knob by that word: its name, or its option with or without dashes.
bool is_name_of(const std::string& name, const Knob& knob);

/// The knobs that do something in this scene, without the samples. only: names or options to
/// choose; empty = all.
std::vector<Knob> knobs_for(const Facts& facts, const std::set<std::string>& only);

/// One way of rendering that is tried.
struct Setting {
    std::string knob;  ///< empty: the render as it is
    std::string value;
    std::string options;  ///< to add to those of the render
    BiasClass bias_class = BiasClass::Unbiased;
    bool is_now = false;  ///< what the render has already
    bool misses_rare_light = false,
         misses_rare_light_now = false;  ///< this value; that of the knob in the render as it is
    size_t anchor =
        0;  ///< the setting of which it must have the mean, or is told how far it is off
};

/// The render as it is, then what approximations are held against, then all other values. A knob
/// whose present value is the exact one or makes no promise is anchored to the render as it is.
std::vector<Setting> settings_for(const std::vector<Knob>& knobs, const Facts& facts);

}  // namespace velatura::study
