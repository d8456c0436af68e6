// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/actions.h"
#include "compositor/window/shown_layers.h"
#include "compositor/window/tile_mix.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::window {

/// What of each pixel is on the screen.
enum class ShownChannel : uint8_t { Color, Red, Green, Blue, Alpha, Luminance };

/// A line of the table of channels, which keys, menus and tools show.
struct ChannelChoice {
    ShownChannel channel;
    const char* label;  ///< of the tool
    const char* name;
    Action action;
};

std::span<const ChannelChoice> channel_choices();

/// What numbers are drawn as instead of their color.
enum class FalseColor : uint8_t {
    None,
    Stops,    ///< luminance of what is shown, -6 to +6 stops about 0.18
    Samples,  ///< layer `sampleCount`, 0 to the most of a pixel
    Noise,    ///< relative standard error of the beauty, from the layer `variance`: 0.1 to 100 %
};

/// What the screen shows instead of the mix: no part of a look, and saved nowhere.
struct ViewMode {
    std::optional<ShownLayer> layer;  ///< none: the mix
    ShownChannel channel = ShownChannel::Color;
    bool flags_pixels = false;  ///< over the image
    std::string matte = {};     ///< drawn over the image in red, as `--matte` reads it; empty: none
    FalseColor false_color = FalseColor::None;
    float most_samples = 0;  ///< of a pixel, for FalseColor::Samples

    bool operator==(const ViewMode&) const = default;

    /// `key, red`; empty for the mix in color.
    std::string text() const;
};

/// A value on the scale of false colors.
struct ScaleMark {
    float t = 0;  ///< place on the scale, 0 to 1
    std::string text;
};

/// From 0 to 1; empty where colors are not false.
std::vector<ScaleMark> scale_of(const ViewMode& mode);

/// The bytes at a place on the scale.
std::array<uint8_t, 3> scale_color(float t);

/// The layer that a false color is made from; empty: what is shown.
const char* layer_of(FalseColor color);

/// Pixels that a screen does not show as they are.
struct FlaggedPixels {
    size_t not_finite = 0;  ///< NaN or infinite, in a layer that is shown or in their mix
    size_t above = 0;       ///< a channel at the most that the display shows, or beyond
    size_t below = 0;       ///< a channel that is negative

    FlaggedPixels& operator+=(const FlaggedPixels& other);
    bool operator==(const FlaggedPixels&) const = default;

    bool is_empty() const { return *this == FlaggedPixels(); }

    /// `3 px NaN/Inf · 12 px clipped`.
    std::string text() const;
};

/// Colors that mark them, as bytes.
inline constexpr std::array<uint8_t, 3> not_finite_mark = {255, 0, 255}, above_mark = {255, 60, 0},
                                        below_mark = {0, 90, 255};
/// What a matte is drawn in, and how much of it covers the image.
inline constexpr std::array<uint8_t, 3> matte_color = {255, 0, 0};
inline constexpr float matte_strength = 0.5f;

struct ShownTile {
    std::vector<uint8_t> rgba;  ///< [pixel][4], opaque
    FlaggedPixels flagged;
};

/// What a tile is shown from.
struct TileSource {
    const LayerStack& stack;
    const mix::MixPlan& plan;
    float exposure_stops = 0;
    const image::DisplayTransform& transform;
    const std::set<std::string>& not_finite;    ///< channels with such values (Levels)
    const std::vector<float>* matte = nullptr;  ///< of the data window; null: none is drawn
};

/// A tile of the image as the mode says. The mix in color without marks is display_rgba of
/// mix_tile. Exposure and display transform act on every layer and channel alike but alpha, which
/// is shown as it is: 0 black, 1 white. NaN and infinite values are shown as 0, as in a mix.
ShownTile show_tile(const TileSource& source, const ViewMode& mode, const image::Window& tile);

/// Flagged pixels of a whole image, tile by tile.
class FlaggedPixelCounts {
  public:
    /// Of a tile of the full size, by its corner; an older image's count of it is replaced.
    void take(size_t look,
              uint64_t version,
              const image::Window& tile,
              const FlaggedPixels& flagged);

    /// None while tiles are missing: pixels counted must be those of the image.
    std::optional<FlaggedPixels> of(size_t look, uint64_t version, size_t pixels) const;

    void clear() { tiles_ = {}; }

  private:
    struct Counted {
        uint64_t version = 0;
        size_t pixels = 0;
        FlaggedPixels flagged;
    };

    std::array<std::map<std::pair<int, int>, Counted>, 2> tiles_;
};

}  // namespace velatura::compositor::window
