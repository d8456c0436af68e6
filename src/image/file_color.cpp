// SPDX-License-Identifier: Apache-2.0
#include "image/file_color.h"

#include "base/nearest_names.h"
#include "image/ocio_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace velatura::image {

namespace ocio = OCIO_NAMESPACE;

namespace {

template <class T>
const T* attribute(const Image& image, size_t part, const char* name) {
    const auto in = [name](const Attributes& attributes) -> const T* {
        const auto at = attributes.find(name);
        return at == attributes.end() ? nullptr : std::get_if<T>(&at->second);
    };
    if (part < image.parts.size()) {
        if (const T* own = in(image.parts[part].attributes)) return own;
    }
    return in(image.attributes);
}

void take_known(FileColor& color, const StandardSpace& known, const char* reason) {
    color.known = &known;
    color.label = known.label;
    color.aces_from_file = aces_from_rgb(known.primaries);
    color.reason = reason;
}

/// True where the config has a space, alias or role of that name.
bool take_space(FileColor& color,
                const ActiveConfig& used,
                const std::string& name,
                const char* reason) {
    const auto space = used.config->getColorSpace(name.c_str());
    if (!space) return false;
    color.space = color.label = space->getName();
    color.aces_from_file = aces_from_space(used.config, color.space);
    color.reason = reason;
    return true;
}

Result<FileColor> asked_color(const std::string& input_space) {
    FileColor color;
    const auto used = active_config();
    if (!used) return used.error();
    if (take_space(color, *used, input_space, "--input-space")) return color;
    if (const StandardSpace* known = standard_space(input_space)) {
        take_known(color, *known, "--input-space");
        return color;
    }
    std::vector<std::string> names = space_names(*used->config);
    const std::string near = did_you_mean(input_space, names);
    for (const StandardSpace& known : standard_spaces()) names.emplace_back(known.names[0]);
    return Error{"unknown-space", fmt::format("no color space '{}'{}; there are: {}", input_space,
                                              near, fmt::join(names, ", "))};
}

/// True where colorInteropID says what the colors are.
Result<bool> take_id(FileColor& color, const std::string& id) {
    if (id.empty() || id == "unknown") return false;
    if (id == "data") {
        color.warnings.emplace_back("colorInteropID is data, not colors");
        return false;
    }
    if (const StandardSpace* known = standard_space(id)) {
        take_known(color, *known, "colorInteropID");
        return true;
    }
    const auto used = active_config();
    if (!used) return used.error();
    if (take_space(color, *used, id, "colorInteropID")) return true;
    color.warnings.push_back(fmt::format(
        "colorInteropID '{}' is neither known nor a space of the OpenColorIO config", id));
    return false;
}

bool take_primaries(FileColor& color, const Chromaticities& primaries) {
    if (const StandardSpace* known = standard_space(primaries)) {
        take_known(color, *known, "chromaticities");
        return true;
    }
    color.aces_from_file = aces_from_rgb(primaries);
    color.reason = "chromaticities";
    color.label = fmt::format("primaries {:.4g}", fmt::join(primaries, " "));
    if (!color.aces_from_file)
        color.warnings.push_back(fmt::format("chromaticities {:.4g} are not valid primaries",
                                             fmt::join(primaries, " ")));
    return color.aces_from_file.has_value();
}

Result<void> take_default(FileColor& color) {
    const auto used = active_config();
    if (!used) return used.error();
    color.reason = "no color space in the header";
    if (used->is_built_in) {
        take_known(color, linear_rec709(), "no color space in the header");
    } else if (!take_space(color, *used, ocio::ROLE_SCENE_LINEAR, "no color space in the header")) {
        color.label = "scene_linear, which the OpenColorIO config does not have";
    }
    color.warnings.push_back(
        fmt::format("the file has no color space; read as {}{}; set it with --input-space",
                    color.label, used->is_built_in ? "" : " (scene_linear of $OCIO)"));
    return {};
}

}  // namespace

Result<FileColor> color_of(const Image& image, const std::string& input_space, size_t part) {
    if (!input_space.empty()) return asked_color(input_space);
    FileColor color;
    const auto* id = attribute<std::string>(image, part, "colorInteropID");
    const auto* primaries = attribute<Chromaticities>(image, part, "chromaticities");
    const auto by_id = take_id(color, id ? *id : std::string());
    if (!by_id) return by_id.error();
    if (*by_id) {
        const StandardSpace* other = primaries ? standard_space(*primaries) : nullptr;
        if (other && color.known && other != color.known)
            color.warnings.push_back(
                fmt::format("colorInteropID is {}, chromaticities are {}: using {}", color.label,
                            other->label, color.label));
        return color;
    }
    if (primaries && take_primaries(color, *primaries)) return color;
    if (auto taken = take_default(color); !taken) return taken.error();
    return color;
}

ColorMatrix file_from_rec709(const FileColor& color) {
    constexpr ColorMatrix same = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (!color.aces_from_file || color.known == &linear_rec709()) return same;
    const auto file_from_aces = inverse(*color.aces_from_file);
    if (!file_from_aces) return same;
    return product(*file_from_aces, *aces_from_rgb(linear_rec709().primaries));
}

Result<std::vector<std::string>> color_spaces() {
    const auto used = active_config();
    if (!used) return used.error();
    return space_names(*used->config);
}

}  // namespace velatura::image
