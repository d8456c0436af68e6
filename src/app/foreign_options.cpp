// SPDX-License-Identifier: Apache-2.0
#include "app/foreign_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace velatura::app {

namespace {

/// Options of others with one value, and ours.
struct Renamed {
    const char *theirs, *ours;
};

constexpr Renamed renamed[] = {
    {"-cam", "--camera"},
    {"--imageWidth", "--image-width"},
    {"-w", "--image-width"},
    {"--purposes", "--purpose"},
    {"--sessionLayer", "--session"},
    {"--renderSettingsPrimPath", "--settings"},
    {"-rs", "--settings"},
    {"--renderPassPrimPath", "--pass"},
    {"-rp", "--pass"},
    {"--pixel-samples", "--spp"},
    {"-p", "--spp"},
    {"-j", "--threads"},
};

/// What is so in any case.
struct AlwaysSo {
    const char* theirs;
};

constexpr AlwaysSo always_so[] = {{"--disableGpu"},
                                  {"--disableCameraLight"},
                                  {"--disableDrawMode"},
                                  {"--enableDomeLightVisibility"},
                                  {"--make-output-path"}};

struct Unmatched {
    const char *theirs, *why;
};

constexpr Unmatched unmatched[] = {
    {"--renderer", "Velatura is the renderer; remove it"},
    {"-R", "Velatura is the renderer; remove it"},
    {"--complexity",
     "curved surfaces are diced by --dicing-rate PIXELS, or to --subdivision-level N"},
    {"--mask", "a prim is hidden by --set '/Prim.visibility=invisible'"},
    {"--headlight", "a stage without lights gets a white dome; a light can be added by --session"},
};

template <class Row>
const Row* row_of(const Row* begin, const Row* end, std::string_view word) {
    const Row* const row = std::find_if(begin, end, [&](const Row& r) { return word == r.theirs; });
    return row == end ? nullptr : row;
}

std::optional<double> number_in(const std::string& text) {
    double value = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || rest != text.data() + text.size()) return std::nullopt;
    return value;
}

Error usage(const std::string& option, const std::string& why) {
    return {"usage", fmt::format("{}: {}", option, why)};
}

/// husk's frames: the first, how many, and the step.
struct HuskFrames {
    std::optional<std::string> first, count, step;

    /// Words of ours; empty: none was given.
    Result<std::vector<std::string>> words() const {
        if (!count && !step)
            return first ? std::vector<std::string>{"--frames", *first}
                         : std::vector<std::string>();
        const std::optional<double> from = number_in(first.value_or("1")),
                                    number = number_in(count.value_or("1")),
                                    by = number_in(step.value_or("1"));
        if (!from || !std::isfinite(*from))
            return usage("--frame-count", "--frame with it is one number");
        constexpr double max_count = 1e6;
        if (!number || !(*number >= 1 && *number <= max_count) || *number != std::floor(*number))
            return usage("--frame-count", "expected a whole number from 1 to 1000000");
        if (!by || !(*by > 0 && std::isfinite(*by)))
            return usage("--frame-inc", "expected a number above 0");
        return std::vector<std::string>{
            "--frames", fmt::format("{}-{}x{}", *from, *from + (*number - 1) * *by, *by)};
    }
};

/// Goes through the words of a render.
class Replacement {
  public:
    explicit Replacement(std::vector<std::string> words) : words_(std::move(words)) {}

    Result<std::vector<std::string>> run() {
        while (at_ < words_.size()) {
            if (const Result<void> ok = take_word(); !ok) return ok.error();
        }
        const Result<std::vector<std::string>> frames = frames_.words();
        if (!frames) return frames.error();
        out_.insert(out_.end(), frames->begin(), frames->end());
        return std::move(out_);
    }

  private:
    /// An option with its value.
    using Take = Result<void> (Replacement::*)(const std::string& option, const std::string& value);

    static Take taker_of(std::string_view option) {
        static const std::unordered_map<std::string_view, Take> takers = {
            {"-f", &Replacement::take_frames},
            {"--frame", &Replacement::take_frames},
            {"--frames", &Replacement::take_frames},
            {"-n", &Replacement::take_count},
            {"--frame-count", &Replacement::take_count},
            {"-i", &Replacement::take_step},
            {"--frame-inc", &Replacement::take_step},
            {"--snapshot", &Replacement::take_snapshot},
            {"--colorCorrectionMode", &Replacement::check_color},
            {"-color", &Replacement::check_color}};
        const auto found = takers.find(option);
        if (found != takers.end()) return found->second;
        return row_of(std::begin(renamed), std::end(renamed), option) ? &Replacement::rename
                                                                      : nullptr;
    }

    Result<void> take_word() {
        const std::string word = words_[at_];
        const size_t sign = word.starts_with("--") ? word.find('=') : std::string::npos;
        const std::string option = word.substr(0, sign);
        if (const Unmatched* r = row_of(std::begin(unmatched), std::end(unmatched), option))
            return usage(option, r->why);
        if (row_of(std::begin(always_so), std::end(always_so), option)) {
            ++at_;
            return {};
        }
        if (option == "-d" || option == "--defaultTime") {
            ++at_;
            return push({"--frames", "default"});
        }
        if (option == "-r") return take_resolution();
        const Take take = taker_of(option);
        const bool has_value = sign != std::string::npos || at_ + 1 < words_.size();
        if (!take || !has_value) return take_own_word();
        const std::string value = sign == std::string::npos ? words_[++at_] : word.substr(sign + 1);
        ++at_;
        return (this->*take)(option, value);
    }

    /// The second argument of usdrecord is the output.
    Result<void> take_own_word() {
        const bool is_scene = is_scene_name(words_[at_]);
        out_.push_back(words_[at_++]);
        if (is_scene && at_ < words_.size() && words_[at_].ends_with(".exr"))
            return push({"-o", words_[at_++]});
        return {};
    }

    /// Of husk two numbers, of usdrecord a name.
    Result<void> take_resolution() {
        const std::string next = at_ + 1 < words_.size() ? words_[at_ + 1] : std::string();
        if (!number_in(next.substr(0, next.find('x'))))
            return usage("-r",
                         "Velatura is the renderer; as in husk it is the resolution: -r 640 360");
        words_[at_] = "--res";
        return {};
    }

    Result<void> rename(const std::string& option, const std::string& value) {
        return push({row_of(std::begin(renamed), std::end(renamed), option)->ours, value});
    }

    /// usdrecord writes ranges with a colon.
    Result<void> take_frames(const std::string&, const std::string& value) {
        frames_.first = value;
        std::replace(frames_.first->begin(), frames_.first->end(), ':', '-');
        return {};
    }

    Result<void> take_count(const std::string&, const std::string& value) {
        frames_.count = value;
        return {};
    }

    Result<void> take_step(const std::string&, const std::string& value) {
        frames_.step = value;
        return {};
    }

    /// husk has seconds.
    Result<void> take_snapshot(const std::string& option, const std::string& value) {
        return push({option, number_in(value) ? value + "s" : value});
    }

    Result<void> check_color(const std::string& option, const std::string& mode) {
        if (mode == "disabled") return {};
        return usage(
            option,
            "the EXR is scene-linear, which is `disabled`; `velatura-comp view FILE.exr -o "
            "FILE.png` applies the display transform");
    }

    Result<void> push(const std::vector<std::string>& words) {
        out_.insert(out_.end(), words.begin(), words.end());
        return {};
    }

    std::vector<std::string> words_, out_;
    size_t at_ = 0;
    HuskFrames frames_;
};

}  // namespace

bool is_scene_name(const std::string& word) {
    std::string end = word.substr(word.rfind('.') == std::string::npos ? 0 : word.rfind('.'));
    std::transform(end.begin(), end.end(), end.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return end == ".usda" || end == ".usdc" || end == ".usd" || end == ".usdz";
}

Result<std::vector<std::string>> with_own_options(std::vector<std::string> words) {
    const bool is_render = !words.empty() && (words[0] == "render" || words[0].starts_with('-') ||
                                              is_scene_name(words[0]));
    if (!is_render) return words;
    return Replacement(std::move(words)).run();
}

}  // namespace velatura::app
