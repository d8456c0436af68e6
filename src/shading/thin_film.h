// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

/// Interference in a film without absorption between what is above a surface and its base
/// (docs/adr/0057).
namespace velatura::shading {

/// What an observer sees of light by its wavelength: shares of the channels of a linear space in
/// light that is white to them (CIE 1931 standard observer, illuminant D65). Each channel's shares
/// sum to 1 over the wavelengths; some are negative.
namespace film_observer {

inline constexpr int first_nm = 380, last_nm = 780;

/// Shares of the wavelengths first_nm, first_nm + 1, … last_nm: integrals over the wavelengths are
/// those of linear Rec.709, not clipped, in the other space (docs/adr/0058).
/// working_space: a name of image::standard_space(); linear Rec.709 for one that it does not know.
std::vector<Vec3d> shares(std::string_view working_space = {});

}  // namespace film_observer

/// What interference of light with a path difference leaves of it: means of cos(2πx/λ) and
/// sin(2πx/λ) over the wavelengths, per channel. The functions of the path difference x that
/// Belcour & Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying
/// Iridescence", section 4, approximate by Gaussians; here tabulated.
class FilmSpectrum {
  public:
    struct Means {
        Rgb cosine = Rgb(0.0f), sine = Rgb(0.0f);
    };

    explicit FilmSpectrum(std::string_view working_space = {});

    /// difference: micrometers, ≥ 0. Beyond `reach` no fringes are left.
    Means at(float difference) const;

    static constexpr float reach = 24.0f;

  private:
    static constexpr int steps_per_unit = 160;
    std::vector<Means> table_;
};

/// Where microfacets of a GGX width reflect, by the cosine of light on them: the cosines of equal
/// shares of the lobe, in ascending order. The mean of a function over them is its mean over the
/// lobe, which grows exact as the function changes little from one to the next.
class FacetCosines {
  public:
    static constexpr int count = 8, average_count = 16;

    FacetCosines();

    /// For one direction; mu in [0, 1]. alpha below specular_switch_alpha: a mirror.
    std::array<float, count> at(float mu, float alpha) const;
    /// For all directions, with the weight of their cosines.
    std::array<float, average_count> average(float alpha) const;

  private:
    static constexpr int rows = 20, columns = 40;
    std::vector<std::array<float, count>> at_;               // [row][column]
    std::vector<std::array<float, average_count>> average_;  // [row]
};

/// Of films in one working space.
struct FilmTables {
    FilmSpectrum spectrum;
    const FacetCosines& cosines;

    /// Made when first asked for, in 0.1 s. working_space: as of film_observer::shares().
    static const FilmTables& of_process(std::string_view working_space);
};

/// A reflectance at nodes of the cosine, which are dense at grazing incidence; linear in the root
/// of the cosine from one to the next.
template <int count>
class CosineNodes {
  public:
    /// reflectance: of a cosine in [0, 1], as Rgb.
    template <typename Reflectance>
    explicit CosineNodes(const Reflectance& reflectance) {
        for (int i = 0; i < count; ++i) {
            const float root = float(i) / float(count - 1);
            values_[size_t(i)] = reflectance(root * root);
        }
    }

    /// cosine in [0, 1].
    Rgb at(float cosine) const {
        const float scaled = std::sqrt(cosine) * float(count - 1);
        const size_t i = std::min(size_t(scaled), size_t(count - 2));
        return values_[i] + (values_[i + 1] - values_[i]) * (scaled - float(i));
    }

  private:
    std::array<Rgb, size_t(count)> values_;
};

/// What film and base reflect where a film covers all: to 1e-3 of its fringes, and of what they do
/// at grazing incidence.
using FilmCurve = CosineNodes<513>;
/// The same for means over many cosines.
using FilmNodes = CosineNodes<17>;

/// A film at one point. All finite.
struct FilmParameters {
    const FilmTables* tables = nullptr;
    float weight = 0;      ///< share of the surface that it covers, [0, 1]
    float thickness = 0;   ///< micrometers
    float ior = 1.4f;      ///< of the film, ≥ 1; all indices over that of the surroundings
    float above = 1;       ///< index of what lies on the film: 1, or that of a coat
    float below = 1.5f;    ///< index of the dielectric below it
    Rgb tint = Rgb(1.0f);  ///< factor of what film and dielectric reflect
    float metallic = 0;    ///< share of metal below it, [0, 1]
    Rgb metal_f0 = Rgb(0.0f), metal_f90 = Rgb(1.0f);  ///< of metal without film, as fresnel_schlick
    Rgb metal_tint = Rgb(1.0f);                       ///< factor of what film and metal reflect
    /// Made for all of these but the weight, in place of the series. Null: none. Must outlive what
    /// is made with it.
    const FilmCurve* curve = nullptr;
};

/// Complex index of refraction n + ik.
struct MetalIndex {
    float n = 1, k = 0;
};

/// Index of refraction of a metal that reflects f0 at normal incidence and, as far
/// as any such metal can, `at_82` at a cosine of 1/7. Both in [0, 1].
/// Ref: Gulbrandsen 2014, "Artist Friendly Metallic Fresnel", JCGT 3(4).
MetalIndex metal_index(float f0, float at_82);

/// Reflectance of a base that a film covers in part: Airy's sum over the reflections in the film,
/// averaged over polarizations and, by its Fourier series, over the wavelengths.
class FilmFresnel {
  public:
    /// bare_f0, bare_f90: of the base without film.
    FilmFresnel(const FilmParameters& film, const Rgb& bare_f0, const Rgb& bare_f90);

    /// cosine: on the side of the smaller index, in [0, 1]. Each channel in [0, 1].
    Rgb at(float cosine) const;

    /// The same near enough for means over many cosines, and fast after prepare_means().
    Rgb at_in_mean(float cosine) const;

    /// Tabulates what at_in_mean() reads; worth it for more than some 17 cosines.
    void prepare_means();

    /// Of what the film covers. Terms of the series below smallest_term are left out.
    Rgb covered(float cosine, float smallest_term = 1e-5f) const;

    const FacetCosines& cosines() const { return p_.tables->cosines; }

    /// Changes the grazing reflectance of the base without film.
    void set_bare_f90(const Rgb& f90) { bare_f90_ = f90; }

  private:
    struct Entry;
    bool enter(float cosine, Entry& entry) const;
    Rgb dielectric(float cosine, float smallest_term) const;
    Rgb metal(float cosine, float smallest_term) const;
    Rgb with_bare(const Rgb& covered, float cosine) const;

    FilmParameters p_;
    Rgb bare_f0_, bare_f90_;
    std::array<MetalIndex, 3> metal_index_ = {};
    std::optional<FilmNodes> nodes_;
};

}  // namespace velatura::shading
