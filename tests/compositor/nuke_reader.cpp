// SPDX-License-Identifier: Apache-2.0
#include "compositor/nuke_reader.h"

#include "film/cryptomatte_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <sstream>

namespace velatura::compositor {

namespace {

class Expression {
  public:
    Expression(const std::string& text, const std::function<double(const std::string&)>& look_up)
        : text_(text), look_up_(look_up) {}

    double run() {
        const double value = choice();
        EXPECT_EQ(peek(), '\0') << text_;
        return value;
    }

  private:
    char peek() {
        while (at_ < text_.size() && text_[at_] == ' ') ++at_;
        return at_ < text_.size() ? text_[at_] : '\0';
    }

    bool take(const std::string& word) {
        peek();
        if (text_.compare(at_, word.size(), word) != 0) return false;
        at_ += word.size();
        return true;
    }

    double choice() {
        const double condition = any();
        if (!take("?")) return condition;
        const double yes = choice();
        EXPECT_TRUE(take(":")) << text_;
        const double no = choice();
        return condition != 0 ? yes : no;
    }

    double any() {
        double value = equal();
        while (take("||")) value = double((equal() != 0) | (value != 0));
        return value;
    }

    double equal() {
        double value = sum();
        while (take("==")) value = double(float(value) == float(sum()));
        return value;
    }

    double sum() {
        double value = product();
        for (;;) {
            if (take("+"))
                value += product();
            else if (take("-"))
                value -= product();
            else
                return value;
        }
    }

    double product() {
        double value = factor();
        for (;;) {
            if (take("*"))
                value *= factor();
            else if (take("/"))
                value /= factor();
            else
                return value;
        }
    }

    double factor() {
        if (take("-")) return -factor();
        if (take("(")) {
            const double value = choice();
            EXPECT_TRUE(take(")")) << text_;
            return value;
        }
        const char first = peek();
        if (std::isdigit(uint8_t(first)) != 0 || first == '.') {
            char* end = nullptr;
            const double value = std::strtod(text_.c_str() + at_, &end);
            at_ = size_t(end - text_.c_str());
            return value;
        }
        std::string name;
        while (at_ < text_.size() &&
               (std::isalnum(uint8_t(text_[at_])) != 0 || text_[at_] == '_' || text_[at_] == '.'))
            name += text_[at_++];
        if (name != "pow") return look_up_(name);
        EXPECT_TRUE(take("(")) << text_;
        const double base = choice();
        EXPECT_TRUE(take(",")) << text_;
        const double exponent = choice();
        EXPECT_TRUE(take(")")) << text_;
        return std::pow(base, exponent);
    }

    const std::string& text_;
    const std::function<double(const std::string&)>& look_up_;
    size_t at_ = 0;
};

/// A Tcl word without its quotes or braces.
std::string unquoted(const std::string& word) {
    if (word.size() > 1 && word[0] == '{') return word.substr(1, word.size() - 2);
    if (word.empty() || word[0] != '"') return word;
    std::string text;
    for (size_t i = 1; i + 1 < word.size(); ++i) {
        if (word[i] == '\\') {
            ++i;
            text += word[i] == 'n' ? '\n' : word[i];
        } else {
            // Nuke would run what stands in brackets, and look for variables
            EXPECT_TRUE(word[i] != '[' && word[i] != '$' && word[i] != '"') << word;
            text += word[i];
        }
    }
    return text;
}

/// What a knob with text in it evaluates to.
std::string evaluated(const std::string& knob) {
    std::string text;
    for (size_t i = 0; i < knob.size(); ++i) {
        const std::string folder = "[file dirname [value root.name]]";
        if (knob[i] == '\\') {
            text += knob[++i];
        } else if (knob.compare(i, folder.size(), folder) == 0) {
            text += "FOLDER";
            i += folder.size() - 1;
        } else {
            EXPECT_NE(knob[i], '[') << knob;
            text += knob[i];
        }
    }
    return text;
}

/// Words of a Tcl list.
std::vector<std::string> words_of(const std::string& list) {
    std::vector<std::string> words;
    size_t i = 0;
    while (i < list.size()) {
        if (list[i] == ' ') {
            ++i;
            continue;
        }
        size_t end = i + 1;
        if (list[i] == '{') {
            for (int depth = 1; depth > 0 && end < list.size(); ++end)
                depth += int(list[end] == '{') - int(list[end] == '}');
        } else if (list[i] == '"') {
            while (end < list.size() && list[end] != '"') end += list[end] == '\\' ? 2 : 1;
            ++end;
        } else {
            while (end < list.size() && list[end] != ' ') ++end;
        }
        words.push_back(list.substr(i, end - i));
        i = end;
    }
    return words;
}

/// As Python's csv reads it, with " as quote and \ as escape.
std::vector<std::string> items_of(const std::string& list) {
    std::vector<std::string> items(1);
    bool is_quoted = false;
    for (size_t i = 0; i < list.size(); ++i) {
        if (list[i] == '\\')
            items.back() += list[++i];
        else if (list[i] == '"')
            is_quoted = !is_quoted;
        else if (list[i] == ',' && !is_quoted)
            items.emplace_back();
        else if (list[i] != ' ' || is_quoted || !items.back().empty())
            items.back() += list[i];
    }
    return items;
}

}  // namespace

double nuke_value(const std::string& expression,
                  const std::function<double(const std::string&)>& look_up) {
    return Expression(expression, look_up).run();
}

NukeReader::NukeReader(const std::string& text,
                       const image::Image& layers,
                       const std::map<std::string, std::vector<double>>& turned)
    : layers_(layers) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
        lines_.push_back(line.substr(std::min(line.find_first_not_of(' '), line.size())));
    std::string line;
    while (next(line)) {
        if (line == "Group {") {
            group();
            for (const auto& [name, values] : turned) {
                EXPECT_TRUE(knobs.contains(name)) << name;
                knobs[name] = values;
            }
        } else {
            run(line);
        }
    }
    EXPECT_EQ(line, "end_group");
}

bool NukeReader::next(std::string& line) {
    if (at_ == lines_.size()) return false;
    line = lines_[at_++];
    return true;
}

void NukeReader::run(const std::string& line) {
    if (line.empty() || line[0] == '#' || line.starts_with("version ") ||
        line.starts_with("add_layer ") || line == "end_group")
        return;
    std::istringstream words(line);
    std::string word, name;
    words >> word >> name;
    if (word == "set") {
        named_[name] = stack_.back();
    } else if (word == "push") {
        ASSERT_TRUE(named_.contains(name.substr(1))) << line;
        stack_.push_back(named_.at(name.substr(1)));
    } else {
        ASSERT_EQ(name, "{") << line;
        node(word, block());
    }
}

NukeReader::Knobs NukeReader::block() {
    Knobs found;
    std::string line;
    while (next(line) && line != "}") {
        const size_t space = line.find(' ');
        found[line.substr(0, space)] = line.substr(space + 1);
    }
    EXPECT_EQ(line, "}");
    return found;
}

void NukeReader::group() {
    std::string line;
    while (next(line) && line != "}") {
        const size_t space = line.find(' ');
        const std::string key = line.substr(0, space), value = line.substr(space + 1);
        if (key == "addUserKnob") {
            const auto words = words_of(unquoted(value));
            ASSERT_GE(words.size(), 4u) << line;
            EXPECT_EQ(words[2], "l");
            if (words[0] == "20") continue;
            EXPECT_TRUE(words[0] == "7" || words[0] == "18" || words[0] == "6") << line;
            EXPECT_FALSE(knobs.contains(words[1])) << line;
            knobs[words[1]] =
                words[0] == "18" ? std::vector<double>{0, 0, 0} : std::vector<double>{0};
            labels[words[1]] = unquoted(words[3]);
        } else if (knobs.contains(key)) {
            const auto words = words_of(value[0] == '{' ? unquoted(value) : value);
            ASSERT_EQ(words.size(), knobs[key].size()) << line;
            for (size_t i = 0; i < words.size(); ++i)
                knobs[key][i] = words[i] == "true"    ? 1
                                : words[i] == "false" ? 0
                                                      : std::strtod(words[i].c_str(), nullptr);
        } else {
            EXPECT_EQ(key, "name") << line;
        }
    }
}

NukeReader::Pixels NukeReader::pop() {
    EXPECT_FALSE(stack_.empty());
    Pixels p = std::move(stack_.back());
    stack_.pop_back();
    return p;
}

NukeReader::Pixels NukeReader::layer(const std::string& name) const {
    Pixels p;
    const char* const suffixes[] = {"R", "G", "B", "A"};
    for (size_t c = 0; c < 4; ++c) {
        p[c].assign(layers_.data.pixel_count(), 0.0f);
        for (const image::Part& part : layers_.parts) {
            for (const image::Channel& channel : part.channels) {
                std::string full = channel.name;
                for (char& k : full)
                    if (std::isalnum(uint8_t(k)) == 0) k = '_';
                const std::string wanted = name == "rgba" ? suffixes[c] : name + "_" + suffixes[c];
                if (full == wanted)
                    image::for_each_value(channel, [&](size_t i, float v) { p[c][i] = v; });
            }
        }
    }
    return p;
}

void NukeReader::multiply(const Knobs& k) {
    Pixels p = pop();
    const Pixels mask = k.contains("inputs") ? pop() : Pixels{};
    const bool is_inverted = k.contains("invert_mask");
    if (k.contains("inputs")) {
        EXPECT_EQ(k.at("inputs"), "1+1");
        EXPECT_EQ(k.at("maskChannelInput"), "rgba.alpha");
    }
    const auto values = words_of(unquoted(k.at("value")));
    ASSERT_EQ(values.size(), 4u);
    for (size_t c = 0; c < 3; ++c) {
        const auto factor = float(nuke_value(unquoted(values[c]), [this](const std::string& name) {
            EXPECT_TRUE(name.starts_with("parent.")) << name;
            std::string knob = name.substr(7);
            size_t index = 0;
            if (const size_t dot = knob.find('.'); dot != std::string::npos) {
                index = std::string("rgb").find(knob.substr(dot + 1));
                knob = knob.substr(0, dot);
            }
            EXPECT_TRUE(knobs.contains(knob)) << name;
            return knobs.contains(knob) ? knobs.at(knob).at(index) : 0.0;
        }));
        for (size_t i = 0; i < p[c].size(); ++i) {
            const float m = mask[3].empty() ? 1.0f : is_inverted ? 1.0f - mask[3][i] : mask[3][i];
            p[c][i] = m == 1.0f ? p[c][i] * factor : p[c][i] * (1.0f + m * (factor - 1.0f));
        }
    }
    stack_.push_back(std::move(p));
}

/// By the names, and by the expression, which must be the same.
void NukeReader::cryptomatte(const Knobs& k) {
    pop();
    EXPECT_EQ(k.at("matteOutput"), "alpha");
    const std::string list = evaluated(unquoted(k.at("matteList"))),
                      of = unquoted(k.at("cryptoLayer")), text = unquoted(k.at("expression"));
    matte_lists.push_back(list);
    const test::CryptomatteDecoder decoder(layers_, of);
    Pixels p;
    p.fill(std::vector<float>(layers_.data.pixel_count(), 0.0f));
    for (const std::string& item : items_of(list)) {
        const bool is_number = item.starts_with('<') && item.ends_with('>');
        const auto matte =
            is_number
                ? decoder.of_id(std::bit_cast<uint32_t>(std::strtof(item.c_str() + 1, nullptr)))
                : decoder.matte(item);
        for (size_t i = 0; i < matte.size(); ++i) p[3][i] += matte[i];
    }
    for (size_t i = 0; i < p[3].size(); i += 7) {
        const double value = nuke_value(text, [&](const std::string& name) {
            const size_t dot = name.find('.');
            const char suffix = char(std::toupper(uint8_t(name[dot + 1])));
            for (const image::Part& part : layers_.parts) {
                for (const image::Channel& c : part.channels) {
                    std::string level = c.name.substr(0, c.name.rfind('.'));
                    for (char& l : level)
                        if (std::isalnum(uint8_t(l)) == 0) l = '_';
                    if (level == name.substr(0, dot) && c.name.back() == suffix)
                        return double(c.value(i));
                }
            }
            ADD_FAILURE() << name;
            return 0.0;
        });
        EXPECT_NEAR(value, double(p[3][i]), 1e-6) << list;
    }
    stack_.push_back(std::move(p));
}

void NukeReader::node(const std::string& kind, const Knobs& k) {
    EXPECT_TRUE(nodes.insert(k.at("name") + (kind == "Read" ? " Read" : "")).second)
        << k.at("name") << " twice";
    if (kind == "Read") {
        file = evaluated(unquoted(k.at("file")));
        if (k.contains("first")) range = k.at("first") + " " + k.at("last");
        stack_.push_back(layer("rgba"));
    } else if (kind == "Input") {
        // What the group is connected to is on the stack
    } else if (kind == "Output") {
    } else if (kind == "Shuffle") {
        pop();
        EXPECT_EQ(k.at("alpha"), "black");
        stack_.push_back(layer(k.at("in")));
        std::fill(stack_.back()[3].begin(), stack_.back()[3].end(), 0.0f);
    } else if (kind == "Multiply") {
        multiply(k);
    } else if (kind == "Clamp") {
        EXPECT_EQ(k.at("channels"), "alpha");
        for (float& v : stack_.back()[3]) v = std::clamp(v, 0.0f, 1.0f);
    } else if (kind == "Cryptomatte") {
        cryptomatte(k);
    } else if (kind == "Merge2") {
        EXPECT_EQ(k.at("operation"), "plus");
        Pixels b = pop(), a = pop();
        for (size_t c = 0; c < 3; ++c)
            for (size_t i = 0; i < a[c].size(); ++i) a[c][i] += b[c][i];
        stack_.push_back(std::move(a));
    } else {
        ASSERT_EQ(kind, "Copy");
        Pixels b = pop();
        pop();
        const std::string from = k.at("from0");
        EXPECT_TRUE(from.ends_with(".alpha")) << from;
        b[3] = layer(from.substr(0, from.size() - 6))[3];
        stack_.push_back(std::move(b));
    }
}

}  // namespace velatura::compositor
