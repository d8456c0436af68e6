// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/pass_names.h"

#include "base/characters.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <vector>

namespace velatura::compositor {
inline namespace io {

namespace {

bool is_upper(char c) {
    return std::isupper(static_cast<unsigned char>(c)) != 0;
}

bool is_alnum(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0;
}

/// `VRayBumpNormals_2` → bump normals: words in lower case, without digits and the renderer's name.
std::vector<std::string> words_of_name(const std::string& name) {
    std::vector<std::string> words;
    bool is_new = true;
    for (size_t i = 0; i < name.size(); ++i) {
        const char c = name[i];
        if (!is_alnum(c) || is_digit(c)) {
            is_new = true;
            continue;
        }
        const bool after_lower = i > 0 && is_alnum(name[i - 1]) && !is_upper(name[i - 1]);
        const bool before_lower = i > 0 && is_upper(name[i - 1]) && i + 1 < name.size() &&
                                  is_alnum(name[i + 1]) && !is_upper(name[i + 1]) &&
                                  !is_digit(name[i + 1]);
        if (is_new || (is_upper(c) && (after_lower || before_lower))) words.emplace_back();
        words.back() += char(std::tolower(static_cast<unsigned char>(c)));
        is_new = false;
    }
    // `VRayDiffuseFilter` is the words v ray diffuse filter
    if (words.size() > 2 && words[0] == "v" && words[1] == "ray")
        words.erase(words.begin(), words.begin() + 2);
    return words;
}

/// The words in one.
std::string squeezed(const std::vector<std::string>& words) {
    std::string all;
    for (const std::string& word : words) all += word;
    return all;
}

template <size_t N>
bool has(const std::array<const char*, N>& list, const std::string& word) {
    return std::find(list.begin(), list.end(), word) != list.end();
}

/// Where a word of the table has to stand.
enum class Place { Whole, First, Last };

struct DataNames {
    Place place;
    std::vector<std::string_view> names;
};

/// Whole names are the words in one, without digits: `Object ID 2` is `objectid`.
const std::vector<DataNames>& data_names() {
    using enum Place;
    static const std::vector<DataNames> table = {
        // Positions, normals, texture coordinates, derivatives, motion
        {Whole, {"n",          "ng",
                 "ns",         "nn",
                 "ngn",        "non",
                 "nref",       "nworld",
                 "neye",       "p",
                 "pref",       "pworld",
                 "peye",       "po",
                 "pz",         "hitn",
                 "hitp",       "hitpz",
                 "wpref",      "wnref",
                 "worldp",     "worldn",
                 "u",          "v",
                 "uv",         "st",
                 "uvtan",      "tn",
                 "dpdu",       "dpdv",
                 "dpds",       "dpdt",
                 "dpdtime",    "dpcameradtime",
                 "dsdx",       "dsdy",
                 "dtdx",       "dtdy",
                 "dufp",       "dvfp",
                 "vector",     "motionvec",
                 "forward",    "backward",
                 "motionfore", "motionback",
                 "hitdist",    "hitstack"}},
        {First, {"normal", "normals", "position", "positions", "motion", "velocity", "uv"}},
        {Last,
         {"normal", "normals", "position", "positions", "velocity", "uv", "uvs", "motionvector",
          "motionvectors", "vectors", "tangent", "bitangent"}},
        // Depth
        {Whole, {"z", "zback", "zfiltered", "zdepth", "mist", "defocusamount"}},
        {First, {"depth"}},
        {Last, {"depth"}},
        // Identities and mattes
        {Whole,
         {"id", "primid", "instanceid", "elementid", "element", "indexob", "indexma", "rawid",
          "objectid", "materialid", "renderid", "nodeid", "object", "shader", "coverage",
          "barycentric", "drbucket", "alpha"}},
        {First, {"crypto", "cryptomatte", "multimatte", "puzzlematte", "id"}},
        {Last,
         {"id", "ids", "index", "matte", "mattes", "mask", "holdout", "opacity", "cryptomatte",
          "stencil"}},
        // Factors of light: surface colors, what was divided by them, filters, occlusion
        {Whole,
         {"diffcol", "glosscol", "transcol", "subsurfacecol", "diffusecolor", "glossycolor",
          "transmissioncolor", "basecolor", "ambientocclusion", "oi", "fresnel", "ior",
          "reflectior"}},
        {First, {"albedo", "ao", "raw"}},
        {Last,
         {"albedo", "ao", "occlusion", "raw", "filter", "roughness", "glossiness", "metalness",
          "curvature"}},
        {Whole,
         {"facingratio", "incidenceangle", "wireframe", "wirecolor", "wire", "visibility",
          "samplerinfo"}},
        // What tells how it was rendered, and inputs of denoisers
        {Whole,
         {"samples", "primarysamples", "cputime", "rendertime", "heatmap", "weight", "mse",
          "convergence", "confidence", "aainvdensity", "aaoffset", "raycount", "noise",
          "dicingquality", "samplecount", "samplerate", "noiselevel"}},
        {First, {"denoising", "debug", "guiding", "noisy"}},
        {Last, {"variance", "var", "mse", "error", "count"}},
        // Copies of the beauty, whole or changed
        {Whole,
         {"effectsresult", "unclampedcolor", "beautyunshadowed", "lightmix", "cshadinglightmix"}},
        {Last, {"denoise", "denoised", "denoiser", "unshadowed"}},
    };
    return table;
}

bool is_data(const std::vector<std::string>& words) {
    if (words.empty()) return false;
    const std::string all = squeezed(words);
    constexpr std::array lights = {"light", "lights", "lgt", "lamp", "lamps"};
    // What no light is, whatever it is of
    constexpr std::array changed_copies = {"variance", "var",      "mse",        "error", "denoise",
                                           "denoised", "denoiser", "unshadowed", "raw",   "filter"};
    const bool names_light = std::any_of(words.begin(), words.end(),
                                         [&](const std::string& w) { return has(lights, w); });
    // `position_light` and `Light ID 1` are lights; `raw_light` is what a filter multiplies
    const bool is_of_light = names_light && words[0] != "raw";
    for (const DataNames& row : data_names()) {
        const std::string& word = row.place == Place::Whole   ? all
                                  : row.place == Place::First ? words.front()
                                                              : words.back();
        if (is_of_light && row.place != Place::Whole && !has(changed_copies, word)) continue;
        if (std::find(row.names.begin(), row.names.end(), word) != row.names.end()) return true;
    }
    // `zdepth`, `rgbalbedo`, `bumpnormals`: words that names run together
    constexpr std::array<std::string_view, 7> ends = {"albedo",    "normal", "normals",  "position",
                                                      "positions", "depth",  "occlusion"};
    return !is_of_light && std::any_of(ends.begin(), ends.end(),
                                       [&](std::string_view e) { return all.ends_with(e); });
}

constexpr std::array beauty_names = {"combined", "rgba",       "rgb",           "beauty",
                                     "ci",       "c",          "rgbcolor",      "color",
                                     "image",    "finalimage", "cshadingbeauty"};

bool is_expression(const std::string& name) {
    return name.find_first_of("<>[](){}'\"|*+^") != std::string::npos;
}

/// Whose light it is stands behind: Arnold's and Cycles' light groups, V-Ray's light selects.
bool names_light_group(const std::string& word, const std::vector<std::string>& words) {
    constexpr std::array<std::string_view, 5> beginnings = {
        "RGBA_", "Combined_", "LightSelect", "VRayLightSelect", "CShading_LightSelect"};
    return std::any_of(beginnings.begin(), beginnings.end(),
                       [&](std::string_view b) { return word.starts_with(b); }) &&
           words.back() != "denoise" && words.back() != "denoised";
}

}  // namespace

std::string last_word(const std::string& name) {
    const size_t dot = name.rfind('.');
    return is_expression(name) || dot == std::string::npos || dot + 1 == name.size()
               ? name
               : name.substr(dot + 1);
}

PassKind pass_kind(const std::string& name) {
    if (is_expression(name)) return PassKind::Light;
    const std::string word = last_word(name);
    const std::vector<std::string> words = words_of_name(word);
    if (words.empty() || names_light_group(word, words)) return PassKind::Light;
    if (beauty_rank(name) < beauty_names.size()) return PassKind::Beauty;
    return is_data(words) ? PassKind::Data : PassKind::Light;
}

size_t beauty_rank(const std::string& name) {
    std::string plain = last_word(name);
    for (char& c : plain)
        c = c == '_' || c == ' ' ? ' ' : char(std::tolower(static_cast<unsigned char>(c)));
    std::erase(plain, ' ');
    const auto at = std::find(beauty_names.begin(), beauty_names.end(), plain);
    return size_t(at - beauty_names.begin());
}

bool is_shadow_pass(const std::string& name) {
    const std::vector<std::string> words = words_of_name(last_word(name));
    return !words.empty() && (words.back() == "shadow" || words.back() == "shadows");
}

}  // namespace io
}  // namespace velatura::compositor
