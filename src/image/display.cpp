// SPDX-License-Identifier: Apache-2.0
#include "image/display.h"

#include "base/nearest_names.h"
#include "image/ocio_config.h"

#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>

#include <algorithm>

namespace velatura::image {

namespace ocio = OCIO_NAMESPACE;

namespace {

/// ` (did you mean 'ACES'?)` for a display or view that the config lacks.
std::string nearest_view(const ocio::ConstConfigRcPtr& config,
                         const std::string& display,
                         const std::string& view) {
    std::vector<std::string> displays, views;
    for (int d = 0; d < config->getNumDisplays(); ++d) {
        displays.emplace_back(config->getDisplay(d));
        for (int v = 0; v < config->getNumViews(displays.back().c_str()); ++v)
            views.emplace_back(config->getView(displays.back().c_str(), v));
    }
    const bool has_display =
        display.empty() || std::find(displays.begin(), displays.end(), display) != displays.end();
    return has_display ? did_you_mean(view, views) : did_you_mean(display, displays);
}

std::string list_of_views(const ocio::ConstConfigRcPtr& config) {
    std::string list;
    for (int d = 0; d < config->getNumDisplays(); ++d) {
        const char* display = config->getDisplay(d);
        for (int v = 0; v < config->getNumViews(display); ++v) {
            list += fmt::format("{}{} / {}", list.empty() ? "" : ", ", display,
                                config->getView(display, v));
        }
    }
    return list;
}

/// Where the numbers of a file enter a config.
struct Source {
    std::string space;
    std::optional<ColorMatrix> space_from_file;
    std::string warning;
};

Source source_of(const ActiveConfig& used, const FileColor& color) {
    const auto& [config, is_built_in] = used;
    if (!color.space.empty()) return {color.space, {}, {}};
    if (color.known) {
        for (const std::string_view name : color.known->names) {
            const auto space = config->getColorSpace(std::string(name).c_str());
            if (space && !space->isData()) return {space->getName(), {}, {}};
        }
    }
    if (color.aces_from_file) {
        if (const auto anchor = anchor_of(config))
            return {anchor->space,
                    product(*inverse(anchor->aces_from_space), *color.aces_from_file),
                    {}};
    }
    Source linear{ocio::ROLE_SCENE_LINEAR, {}, {}};
    if (is_built_in) linear.space = "lin_rec709";
    if (color.aces_from_file)
        linear.warning = fmt::format(
            "the OpenColorIO config has no color space for {}, nor the role aces_interchange to "
            "convert by: shown as if it were scene_linear",
            color.label);
    return linear;
}

}  // namespace

Result<std::vector<DisplayViews>> display_views() {
    const auto used = active_config();
    if (!used) return used.error();
    const ocio::ConstConfigRcPtr& config = used->config;
    std::vector<DisplayViews> all;
    for (int d = 0; d < config->getNumDisplays(); ++d) {
        DisplayViews of_display;
        of_display.display = config->getDisplay(d);
        const char* display = of_display.display.c_str();
        for (int v = 0; v < config->getNumViews(display); ++v)
            of_display.views.emplace_back(config->getView(display, v));
        const bool is_default = of_display.display == config->getDefaultDisplay();
        all.insert(is_default ? all.begin() : all.end(), std::move(of_display));
    }
    return all;
}

struct DisplayTransform::Impl {
    ocio::ConstCPUProcessorRcPtr processor;
    std::vector<std::string> warnings;
};

DisplayTransform::DisplayTransform(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

DisplayTransform::~DisplayTransform() = default;
DisplayTransform::DisplayTransform(DisplayTransform&&) noexcept = default;
DisplayTransform& DisplayTransform::operator=(DisplayTransform&&) noexcept = default;

Result<DisplayTransform> DisplayTransform::make(const std::string& display,
                                                const std::string& view,
                                                const FileColor& color) {
    const auto used = active_config();
    if (!used) return used.error();
    const ocio::ConstConfigRcPtr& config = used->config;
    try {
        const std::string known_display = display.empty() ? config->getDefaultDisplay() : display;
        const std::string known_view =
            view.empty() ? config->getDefaultView(known_display.c_str()) : view;
        const Source source = source_of(*used, color);
        auto transform = ocio::DisplayViewTransform::Create();
        transform->setSrc(source.space.c_str());
        transform->setDisplay(known_display.c_str());
        transform->setView(known_view.c_str());
        auto chain = ocio::GroupTransform::Create();
        const char* shown =
            config->getDisplayViewColorSpaceName(known_display.c_str(), known_view.c_str());
        const auto shown_space = config->getColorSpace(shown);
        // A view of data shows the numbers as they are
        const bool is_raw = shown_space && shown_space->isData();
        if (source.space_from_file && !is_raw)
            chain->appendTransform(matrix_transform(*source.space_from_file));
        chain->appendTransform(transform);
        auto impl = std::make_unique<Impl>();
        impl->processor = config->getProcessor(chain)->getDefaultCPUProcessor();
        impl->warnings = color.warnings;
        if (!source.warning.empty()) impl->warnings.push_back(source.warning);
        return DisplayTransform(std::move(impl));
    } catch (const std::exception& e) {
        return Error{
            "ocio-view",
            fmt::format("no display transform for display '{}' view '{}'{}: {}; there are: {}",
                        display, view, nearest_view(config, display, view), e.what(),
                        list_of_views(config))};
    }
}

const std::vector<std::string>& DisplayTransform::warnings() const {
    return impl_->warnings;
}

void DisplayTransform::apply(std::vector<float>& rgb) const {
    if (rgb.empty()) return;
    ocio::PackedImageDesc image(rgb.data(), long(rgb.size() / 3), 1, 3);
    impl_->processor->apply(image);
}

}  // namespace velatura::image
