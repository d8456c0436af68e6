// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/pixel_means.h"
#include "image/window.h"
#include "statistics/relative_error.h"

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace velatura::statistics {

/// One channel of an image, and the squared standard error of each of its pixels as far as its
/// samples show it: an estimate of one degree of freedom. [height][width].
struct NoisyChannel {
    std::vector<float> mean, variance;
};

/// RGB.
using NoisyImage = std::array<NoisyChannel, 3>;

/// Of the pixels around one, itself left out.
struct Neighborhood {
    double count = 0;
    double means = 0, squares = 0, variances = 0;  ///< sums

    static constexpr int radius = 2;  ///< pixels

    void add(double mean, double variance) {
        count += 1;
        means += mean;
        squares += mean * mean;
        variances += variance;
    }
};

/// What the error of a pixel is relative to in place of its true mean.
struct ErrorBase {
    /// The mean around it and its own, weighed by how much pixels around differ beyond their noise
    /// and by its own noise (Lee 1980, Digital image enhancement and noise filtering by use of
    /// local statistics), within two standard errors of its own mean. A bright sample that one
    /// pixel met does not hide behind itself, as its variance is its squared mean; a lamp of one
    /// pixel, whose noise is small beside it, keeps its brightness.
    double likely = 0;

    /// The mean around it where its own is far above all around it: a rare bright sample, or a
    /// small bright thing with much noise. Else its own mean.
    double beside = 0;
};

ErrorBase error_base(double mean, double variance, const Neighborhood& around);

/// [height][width].
struct ErrorBases {
    std::vector<float> likely, beside;

    /// Of a pixel that hangs on one sample or two, as its standard error is 0.7 of its mean or
    /// above, what a quarter of those around are below: at the edge of a lamp it may be the dark
    /// beside the lamp that met its light by chance. Else `likely`.
    std::vector<float> dark;
};

ErrorBases error_bases(int width, int height, const NoisyChannel& channel);
std::array<ErrorBases, 3> error_bases(int width, int height, const NoisyImage& image);

/// √relMSE: the root of the mean, over pixels and channels, of variance / (base² + 0.01), from
/// strips: runs of rows of the image, each row in one of them. The interval is from the scatter
/// among 16 interleaved sets of pixels, which differ by noise alone.
///
/// Every figure of the error of one image is this one: the render's, from changes as samples
/// double (image_change.h), and that of mixes, from half images. It is by the likely bases, and
/// a lower bound where it is not known to ±10 % with 95 % confidence (derived in
/// docs/engineering/numerics.md, Error):
/// - what few pixels hold, by few_pixels; of one that hangs on a sample or two, what its unknown
///   coverage by a bright thing leaves open counts as the variance of its square;
/// - where it would be more than a tenth less if pixels far above all around them were as bright as
///   their halves say of each other; what is stated goes then to at most a tenth above what it
///   would be if they were as bright as they look.
class ImageErrorSum {
  public:
    /// Rows [first, end) of a strip. Its other rows are what these are judged by: `radius` of
    /// Neighborhood to either side, less at the edge of the image. top: row of the image that is
    /// row 0 of the strip; strip, bases: [height of the strip][width].
    void add(int width,
             int top,
             int first,
             int end,
             const NoisyImage& strip,
             const std::array<ErrorBases, 3>& bases);

    /// Strips that another sum took.
    void add(const ImageErrorSum& other);

    RelativeError result() const;

  private:
    /// By the set that pixels are dealt to.
    using BySet = std::array<double, accumulate::interleaved_sets>;

    /// Squares that share the first bits of their logarithm, to within a thirtieth.
    struct Bin {
        size_t count = 0;
        double sum = 0;
    };

    /// Pixels far above all around them. The bright half of a rare sample's pixel says nothing of
    /// the other half; that of a small bright thing does.
    struct Outliers {
        /// How far the brighter and the darker half are above what is around, in all.
        double brighter = 0, darker = 0;
        double darker_squares = 0;  ///< of pixels

        static constexpr int steps = 64;

        /// What is added to the sum of squares where the bases are at least so many steps from what
        /// is around to the brighter half, and at least the mean of all 25 pixels.
        std::array<double, steps + 1> change{};
        double own_change = 0;  ///< the same where they are at least their own means

        /// The step that holds the true mean, as far as the darker halves tell: two standard errors
        /// above.
        size_t step() const;
    };

    void add_outlier(const NoisyImage& strip, const std::array<ErrorBases, 3>& bases, size_t i);
    size_t half_in() const;

    BySet likely_{}, counts_{};
    Outliers outliers_;
    double variance_ = 0;  ///< of the sum of squares: what is not known of the pixels
    double worst_ = -1;    ///< the largest square, by the dark bases
    int worst_x_ = -1, worst_y_ = -1;
    std::vector<Bin> bins_;  ///< of pixels, by the dark bases; [float bits / 2^18]
};

/// Writes the pixels of row y of an image into a strip, from index `at` of each channel on.
/// Returns: whether the noise of all of them is known. Called by several threads, for some rows
/// twice.
using FillRow = std::function<bool(int y, size_t at, NoisyImage& strip)>;

/// ImageErrorSum of an image that is made strip by strip. Returns: nothing unless the noise of
/// every row is known; ends soon where it is not.
std::optional<RelativeError> image_error(const image::Window& window, const FillRow& fill);
RelativeError image_error(int width, int height, const NoisyImage& image);

}  // namespace velatura::statistics
