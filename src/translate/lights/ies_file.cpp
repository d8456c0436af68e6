// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/ies_file.h"

#include "base/math.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace velatura::translate::lights {

namespace {

/// Degrees that written angles may be off by.
constexpr double angle_tolerance = 1e-3;
/// Angles of either kind; real tables have some hundred.
constexpr size_t max_angles = 100000;
/// Lighthouses have some million; what no light has would leave no digit for the others.
constexpr double max_candela = 1e15;

bool is_close(double a, double b) {
    return std::abs(a - b) <= angle_tolerance;
}

/// The numbers of a text, separated by white space or commas.
class NumberReader {
  public:
    explicit NumberReader(std::string_view text) : text_(text) {}

    /// The next line, without its end; nullopt behind the last.
    std::optional<std::string_view> line() {
        if (at_ >= text_.size()) return std::nullopt;
        const size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
        const std::string_view line = text_.substr(at_, end - at_);
        at_ = end;
        skip_line_end();
        return line;
    }

    std::optional<double> number() {
        while (at_ < text_.size() && is_space(text_[at_])) {
            if (text_[at_] == '\r' || text_[at_] == '\n')
                skip_line_end();
            else
                ++at_;
        }
        if (at_ < text_.size() && text_[at_] == '+') ++at_;
        double value = 0.0;
        const char* const begin = text_.data() + at_;
        const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value);
        if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
        at_ += size_t(end - begin);
        return value;
    }

    /// From 1 on.
    int line_number() const { return line_; }

    size_t rest() const { return text_.size() - at_; }

  private:
    static bool is_space(char c) {
        return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '\0' ||
               c == '\x1a';
    }

    void skip_line_end() {
        if (at_ >= text_.size()) return;
        const bool is_pair = text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n';
        at_ += is_pair ? 2 : 1;
        ++line_;
    }

    std::string_view text_;
    size_t at_ = 0;
    int line_ = 1;
};

/// A table as it is written.
struct Table {
    std::vector<double> vertical, horizontal;  // degrees
    std::vector<std::vector<double>> rows;     // [horizontal][vertical]
};

/// The first failure stays; what is read after it means nothing.
class Parser {
  public:
    explicit Parser(std::string_view text) : in_(text) {}

    Result<scene::IesProfile> run() {
        skip_to_tilt();
        Table table = read_table();
        if (!error_) complete(table);
        if (error_) return *error_;
        return profile_of(table);
    }

  private:
    void fail(const std::string& what, const char* code = "ies-syntax") {
        if (!error_) error_ = {code, fmt::format("line {}: {}", in_.line_number(), what)};
    }

    double number(const char* what) {
        const std::optional<double> value = error_ ? std::nullopt : in_.number();
        if (!value) fail(fmt::format("expected a number: {}", what));
        return value.value_or(0.0);
    }

    size_t count(const char* what) {
        const double value = number(what);
        if (value >= 1.0 && value <= double(max_angles) && value == std::floor(value))
            return size_t(value);
        fail(fmt::format("{} is {}, not a whole number from 1 to {}", what, value, max_angles));
        return 0;
    }

    /// Factors for how a lamp is held dim all of the light and do not shape it.
    void skip_to_tilt() {
        while (const std::optional<std::string_view> line = in_.line()) {
            if (!line->starts_with("TILT=")) continue;
            if (!line->starts_with("TILT=INCLUDE")) return;
            number("the lamp's geometry in the luminaire");
            const size_t angles = count("the number of tilt angles");
            for (size_t i = 0; i < 2 * angles && !error_; ++i) number("tilt angles and factors");
            return;
        }
        fail("not an IES file: no line starts with \"TILT=\"");
    }

    std::vector<double> angles(size_t how_many, const char* what, double max) {
        std::vector<double> all;
        while (all.size() < how_many) {
            const double angle = number(what);
            if (angle < -angle_tolerance || angle > max + angle_tolerance)
                fail(fmt::format("{} are in [0, {}] degrees, not {}", what, max, angle));
            else if (!all.empty() && !(angle > all.back()))
                fail(fmt::format("{} ascend, {} does not", what, angle));
            if (error_) break;
            all.push_back(std::clamp(angle, 0.0, max));
        }
        return all;
    }

    void check_type(double type) {
        if (type == 2.0 || type == 3.0)
            fail(fmt::format("photometry of type {} is not supported, only type C",
                             type == 2.0 ? "B" : "A"),
                 "ies-unsupported");
        else if (type != 1.0)
            fail(fmt::format("unknown photometric type {}", type));
    }

    Table read_table() {
        number("the number of lamps");
        number("lumens per lamp");
        double factor = number("the multiplier of candela values");
        const size_t verticals = count("the number of vertical angles");
        const size_t horizontals = count("the number of horizontal angles");
        check_type(number("the photometric type"));
        for (const char* what : {"the type of units", "the width", "the length", "the height"})
            number(what);
        factor *= number("the ballast factor");
        factor *= number("the photometric factor of ballast and lamp");
        number("the watts");
        if (verticals < 2) fail("expected at least two vertical angles, found one");
        // A number takes two characters: counts that the rest cannot fill take no memory
        if (verticals * horizontals > in_.rest() / 2 + 1) fail("the file ends before its table");

        Table table;
        if (error_) return table;
        table.vertical = angles(verticals, "vertical angles", 180.0);
        table.horizontal = angles(horizontals, "horizontal angles", 360.0);
        table.rows.resize(horizontals);
        for (std::vector<double>& row : table.rows) {
            while (row.size() < verticals && !error_) row.push_back(candela(factor));
        }
        return table;
    }

    double candela(double factor) {
        const double value = factor * number("candela values");
        if (!(value >= 0.0 && value <= max_candela))
            fail(fmt::format("a candela value is {}", value));
        return value;
    }

    /// Adds what a plane reflects, its angle given twice.
    static void reflect(Table& table, double twice_the_plane) {
        for (size_t i = table.horizontal.size(); i-- > 0;) {
            const double mirrored = twice_the_plane - table.horizontal[i];
            if (is_close(mirrored, table.horizontal.back())) continue;
            table.horizontal.push_back(mirrored);
            table.rows.push_back(table.rows[i]);
        }
    }

    /// All around the axis: ascending over less than 360°.
    void complete(Table& table) {
        std::vector<double>& angles = table.horizontal;
        if (angles.size() == 1) return;
        const double first = angles.front(), last = angles.back();
        const double step = std::max(angles[1] - first, last - angles[angles.size() - 2]);
        const bool is_whole = last + step >= 360.0 - angle_tolerance;
        if (is_close(first, 90.0) && is_close(last, 270.0)) {
            reflect(table, 540.0);
        } else if (is_close(first, 0.0) && is_close(last, 90.0)) {
            reflect(table, 180.0);
            reflect(table, 360.0);
        } else if (is_close(first, 0.0) && is_close(last, 180.0)) {
            reflect(table, 360.0);
        } else if (!is_close(first, 0.0) || !is_whole) {
            return fail(fmt::format(
                "horizontal angles from {} to {}: expected 0 to 0, 90, 180 or 360, or 90 to 270",
                first, last));
        }
        // What comes round again
        if (angles.back() - angles.front() < 360.0 - angle_tolerance) return;
        angles.pop_back();
        table.rows.pop_back();
    }

    static scene::IesProfile profile_of(const Table& table) {
        std::vector<size_t> order;
        for (size_t i = 0; i < table.horizontal.size(); ++i) order.push_back(i);
        const auto turned = [&](size_t i) {
            return table.horizontal[i] < 360.0 ? table.horizontal[i] : table.horizontal[i] - 360.0;
        };
        std::sort(order.begin(), order.end(),
                  [&](size_t a, size_t b) { return turned(a) < turned(b); });
        scene::IesProfile profile;
        for (const double angle : table.vertical)
            profile.vertical.push_back(angle * (pi_d / 180.0));
        for (const size_t i : order) {
            profile.horizontal.push_back(turned(i) * (pi_d / 180.0));
            profile.intensity.insert(profile.intensity.end(), table.rows[i].begin(),
                                     table.rows[i].end());
        }
        return profile;
    }

    NumberReader in_;
    std::optional<Error> error_;
};

}  // namespace

Result<scene::IesProfile> parse_ies(std::string_view text) {
    return Parser(text).run();
}

}  // namespace velatura::translate::lights
