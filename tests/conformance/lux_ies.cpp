// SPDX-License-Identifier: Apache-2.0
#include "lux_ies.h"

#include <cmath>
#include <fstream>
#include <string>

namespace velatura::test {

namespace {

/// The part of the way from a to b; 0 where there is none.
double part(double x, double a, double b) {
    return b > a ? (x - a) / (b - a) : 0.0;
}

size_t interval(const std::vector<double>& angles, double x) {
    size_t i = 0;
    while (i + 2 < angles.size() && angles[i + 1] <= x) ++i;
    return i;
}

}  // namespace

LuxIes::LuxIes(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line;
    while (std::getline(in, line) && !line.starts_with("TILT=NONE")) {
    }
    double head[13] =
        {};  // lamps lumens multiplier verticals horizontals type units w l h ballast factor watts
    for (double& value : head) in >> value;
    vertical_.resize(size_t(head[3]));
    horizontal_.resize(size_t(head[4]));
    for (double& angle : vertical_) in >> angle;
    for (double& angle : horizontal_) in >> angle;
    rows_.assign(horizontal_.size(), std::vector<double>(vertical_.size()));
    for (auto& row : rows_)
        for (double& value : row) {
            in >> value;
            value *= head[2] * head[10] * head[11];
        }
}

double LuxIes::folded(double horizontal) const {
    const double first = horizontal_.front(), last = horizontal_.back();
    if (last == 0.0 || last == 360.0) return horizontal;
    if (first == 90.0) {
        if (horizontal < 90.0) return 180.0 - horizontal;
        return horizontal > 270.0 ? 540.0 - horizontal : horizontal;
    }
    if (horizontal > 180.0) horizontal = 360.0 - horizontal;
    return last == 90.0 && horizontal > 90.0 ? 180.0 - horizontal : horizontal;
}

double LuxIes::at(double vertical, double horizontal) const {
    if (vertical < vertical_.front() || vertical > vertical_.back()) return 0.0;
    const double phi = folded(horizontal);
    const size_t v = interval(vertical_, vertical), h = interval(horizontal_, phi);
    const double f = part(vertical, vertical_[v], vertical_[v + 1]);
    const auto along = [&](size_t row) { return std::lerp(rows_[row][v], rows_[row][v + 1], f); };
    if (rows_.size() == 1) return along(0);
    return std::lerp(along(h), along(h + 1), part(phi, horizontal_[h], horizontal_[h + 1]));
}

double LuxIes::mean() const {
    const double radians = std::acos(-1.0) / 180.0;
    const bool is_sphere = vertical_.back() - vertical_.front() > 100.0;
    double sum = 0.0, weight = 0.0;
    for (double v = 0.05; v < 180.0; v += 0.1) {
        double ring = 0.0;
        for (double h = 0.25; h < 360.0; h += 0.5) ring += at(v, h) / 720.0;
        sum += ring * std::sin(v * radians);
        weight += std::sin(v * radians);
    }
    return sum / weight * (is_sphere ? 1.0 : 2.0);
}

double LuxIes::scaled(double vertical, double horizontal, double angle_scale) const {
    // Keys of luxtest that are meant to be 0 are up to 3e-15
    if (std::abs(angle_scale) < 1e-6) return at(vertical, horizontal);
    if (angle_scale > 0.0) vertical = vertical / angle_scale;
    if (angle_scale < 0.0) vertical = (vertical - 180.0) / -angle_scale + 180.0;
    return at(vertical, horizontal);
}

}  // namespace velatura::test
