// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::accumulate {

/// What a data layer holds of the first surface that a camera sample meets; of catchers their
/// light.
enum class DataSource : uint8_t {
    Primvar,         ///< DataLayer::primvar
    Albedo,          ///< directional albedo
    Normal,          ///< shading normal, world space
    EyeNormal,       ///< the same, camera space
    FacetNormal,     ///< geometric normal, world space
    Position,        ///< world space
    EyePosition,     ///< camera space: x right, y up, −z along the view
    Depth,           ///< along the view
    Texture,         ///< texture coordinates
    Element,         ///< index of the authored face, curve or point
    Catcher,         ///< light of catchers as they stand in the scene
    Plate,           ///< the same without everything else, as a plate shows them
    Motion,          ///< pixels that the point moves until the next frame
    BackwardMotion,  ///< pixels to where it was one frame earlier
    ShutterMotion,   ///< pixels that it moves while the shutter is open
};

inline constexpr size_t data_source_count = size_t(DataSource::ShutterMotion) + 1;

/// What becomes of the values of a pixel's samples.
enum class DataFilter : uint8_t {
    Average,  ///< the pixel filter, as for the beauty
    Closest,  ///< the value of the nearest sample
    Min,      ///< the minimum, channel by channel
    Max,      ///< the maximum, channel by channel
};

inline constexpr size_t data_filter_count = size_t(DataFilter::Max) + 1;

/// A data layer that was requested by name.
struct DataLayer {
    std::string name;
    DataSource source = DataSource::Position;
    std::string primvar;  ///< name of DataSource::Primvar
    std::string group;    ///< the light group whose part of a catcher's light it is; empty: all
    DataFilter filter = DataFilter::Average;
    std::string suffixes;  ///< of the channels, one letter each, 1 … 4; one '-': none
    bool is_half = false;  ///< stored as half where no value overflows
    /// The mean is over all samples, as of the beauty, and not over those that have a value alone.
    bool is_premultiplied = false;

    size_t width() const { return suffixes.size(); }

    /// Whether it is made of sums; else one sample's values are kept.
    bool is_summed() const { return filter == DataFilter::Average; }

    /// Accumulators that its sums take: three values; the fourth, the weight and the number of the
    /// samples that have any.
    uint32_t accumulators() const { return is_summed() ? 2 : 0; }

    bool is_motion() const { return source >= DataSource::Motion; }

    bool is_of_catchers() const {
        return source == DataSource::Catcher || source == DataSource::Plate;
    }

    /// Name of a channel in files.
    std::string channel(size_t i) const;

    bool operator==(const DataLayer&) const = default;
};

/// Name of a source in files and on the command line; `primvar` for primvars.
std::string_view name_of(DataSource source);

/// By name, or by one of the names that Hydra, RenderMan, Arnold and Karma have for it.
std::optional<DataSource> find_data_source(std::string_view name);

/// Suffixes of its channels.
std::string_view suffixes_of(DataSource source);

std::string_view name_of(DataFilter filter);
std::optional<DataFilter> find_data_filter(std::string_view name);

/// Whether means are over all samples: colors and directions fade into what is not there.
bool is_premultiplied(DataSource source);

}  // namespace velatura::accumulate
