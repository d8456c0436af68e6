// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "sampling/random_stream.h"

#include <cstdint>

namespace velatura::sampling {

struct PixelShift;

/// What a random number is used for. Together with (seed, pixel, sample index, bounce) it is the
/// whole identity of the number: there is no "next dimension", so switching one effect off never
/// shifts the numbers of another. Never renumber: images depend on the values.
enum class Purpose : uint32_t {
    PixelFilter = 0,
    Lens = 1,
    ShutterTime = 2,
    LightSelect = 3,
    LightSurface = 4,
    BsdfLobe = 5,
    BsdfDirection = 6,
    Roulette = 7,
    Opacity = 8,
    FilterSign = 10,
    GuideSelect = 11,
    GuideDirection = 12,
    LightSelectFine = 13,
    ManifoldLight = 14,
    ManifoldPoint = 15,
    ManifoldCaster = 16,
    ManifoldSeed = 17,
    ManifoldLobe = 18,
    ManifoldTriangle = 19,
    LightDirection = 20,
    LobeWidth = 21,
    Wavelength = 22,
    VolumeDistance = 32,
    VolumeDirection = 33,
    VolumeShadow = 34,
    VolumeCustomShadow = 35,
    VolumeChain = 36,
    InteriorDistance = 37,
    SubsurfaceSelect = 40,
    SubsurfaceEntry = 41,
    SubsurfaceChannel = 42,
    SubsurfaceDistance = 43,
    SubsurfaceDirection = 44,
    SubsurfaceRoulette = 45,
};

/// Which points the samples of a pixel are.
enum class SamplerKind : uint8_t {
    Sobol,  ///< Owen-scrambled Sobol' points, padded in pairs of dimensions
    /// Sobol' points of their own for the even and the odd sample indices: two independent
    /// estimates of everything, whose difference tells the error. Costs up to 1.5 times the
    /// variance.
    SobolHalves,
    /// Sobol' points whose errors make up for each other among neighboring pixels: as good in
    /// every pixel, better wherever an image is filtered, scaled down or looked at from afar.
    BlueNoise,
    BlueNoiseHalves,  ///< as SobolHalves
    Independent,      ///< hashes: plain Monte Carlo, to compare with
    /// Jittered squares: of any 4^k consecutive samples, starting at a multiple of 4^k, one lies in
    /// each of 2^k by 2^k squares, anywhere in it. What strata were before nets, to compare with.
    Stratified,
    StratifiedHalves,  ///< as SobolHalves
};

/// Whether even and odd samples are independent estimates.
constexpr bool has_halves(SamplerKind kind) {
    return kind == SamplerKind::SobolHalves || kind == SamplerKind::BlueNoiseHalves ||
           kind == SamplerKind::StratifiedHalves;
}

/// The numbers of one camera sample. A value; copies are equal.
class PixelSampler {
  public:
    PixelSampler(uint64_t seed,
                 int pixel_x,
                 int pixel_y,
                 uint64_t sample_index,
                 SamplerKind kind = SamplerKind::Sobol);

    /// The numbers of one of `count` branches into which the path of the sample divides. Those of
    /// all samples of a pixel are points of one sequence; what they are used for must be used by
    /// branches alone.
    PixelSampler branch(uint32_t index, uint32_t count) const;

    /// One number in [0, 1). `bounce` counts path vertices from 0 = camera; `repeat` tells apart
    /// several draws of one purpose at one vertex (opacity layers of a ray).
    float get_1d(int bounce, Purpose purpose, uint32_t repeat = 0) const;

    /// The same number with 32 bits instead of 24: for choosing among very many.
    double get_1d_fine(int bounce, Purpose purpose, uint32_t repeat = 0) const;

    /// Two numbers in [0, 1)², stratified together over the samples of a pixel.
    Vec2 get_2d(int bounce, Purpose purpose, uint32_t repeat = 0) const;

    /// Numbers without end for one use. The first of them, with 53 bits, is stratified like get_1d.
    RandomStream stream(int bounce, Purpose purpose, uint32_t repeat = 0) const;

  private:
    /// Sobol' points of whatever arrangement.
    bool is_net() const { return kind_ < SamplerKind::Independent; }

    bool is_independent() const { return kind_ == SamplerKind::Independent; }

    /// get_2d() of what is no net.
    Vec2 classic_2d(uint64_t key) const;

    uint32_t bits_1d(int bounce, Purpose purpose, uint32_t repeat) const;

    uint32_t shuffled_index(uint64_t key) const;

    uint64_t key_;             ///< of the pixel, of its block of pixels for blue noise
    uint32_t reversed_index_;  ///< of the point in its sequence
    SamplerKind kind_;
    uint32_t pixel_salt_ = 0;             ///< blue noise: what tells the pixel from its block
    const PixelShift* shifts_ = nullptr;  ///< blue noise: of the pixel
};

}  // namespace velatura::sampling
