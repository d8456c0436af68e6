// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/value_cast.h"

#include <cmath>
#include <type_traits>

namespace velatura::usd::stage {

using layer::Value;
using layer::ValueType;

namespace {

// Every numeric type as a list of components; two types convert when count and group agree
enum class Group { None, Scalar, Vector, Quaternion, Matrix };

template <class T>
struct Shape {
    static constexpr Group group = Group::None;
    static constexpr int count = 0;
};

template <class T>
struct ScalarShape {
    static constexpr Group group = Group::Scalar;
    static constexpr int count = 1;
    using Number = T;

    static T get(const T& v, int) { return v; }

    static void set(T& v, int, T x) { v = x; }
};

template <class T, class N, int Count>
struct VectorShape {
    static constexpr Group group = Group::Vector;
    static constexpr int count = Count;
    using Number = N;

    static N get(const T& v, int i) { return (&v.x)[i]; }

    static void set(T& v, int i, N x) { (&v.x)[i] = x; }
};

template <class T, class N>
struct QuatShape {
    static constexpr Group group = Group::Quaternion;
    static constexpr int count = 4;
    using Number = N;

    static N get(const T& v, int i) { return i == 0 ? v.r : (&v.v.x)[i - 1]; }

    static void set(T& v, int i, N x) { (i == 0 ? v.r : (&v.v.x)[i - 1]) = x; }
};

template <class T, int Size>
struct MatrixShape {
    static constexpr Group group = Group::Matrix;
    static constexpr int count = Size * Size;
    using Number = double;

    static double get(const T& v, int i) { return v.x[i / Size][i % Size]; }

    static void set(T& v, int i, double x) { v.x[i / Size][i % Size] = x; }
};

// clang-format off
template <> struct Shape<bool> : ScalarShape<bool> {};
template <> struct Shape<uint8_t> : ScalarShape<uint8_t> {};
template <> struct Shape<int32_t> : ScalarShape<int32_t> {};
template <> struct Shape<uint32_t> : ScalarShape<uint32_t> {};
template <> struct Shape<int64_t> : ScalarShape<int64_t> {};
template <> struct Shape<uint64_t> : ScalarShape<uint64_t> {};
template <> struct Shape<layer::Float16> : ScalarShape<layer::Float16> {};
template <> struct Shape<float> : ScalarShape<float> {};
template <> struct Shape<double> : ScalarShape<double> {};
template <> struct Shape<layer::Vec2i> : VectorShape<layer::Vec2i, int, 2> {};
template <> struct Shape<layer::Vec3i> : VectorShape<layer::Vec3i, int, 3> {};
template <> struct Shape<layer::Vec4i> : VectorShape<layer::Vec4i, int, 4> {};
template <> struct Shape<layer::Vec2h> : VectorShape<layer::Vec2h, layer::Float16, 2> {};
template <> struct Shape<layer::Vec3h> : VectorShape<layer::Vec3h, layer::Float16, 3> {};
template <> struct Shape<layer::Vec4h> : VectorShape<layer::Vec4h, layer::Float16, 4> {};
template <> struct Shape<layer::Vec2f> : VectorShape<layer::Vec2f, float, 2> {};
template <> struct Shape<layer::Vec3f> : VectorShape<layer::Vec3f, float, 3> {};
template <> struct Shape<layer::Vec4f> : VectorShape<layer::Vec4f, float, 4> {};
template <> struct Shape<layer::Vec2d> : VectorShape<layer::Vec2d, double, 2> {};
template <> struct Shape<layer::Vec3d> : VectorShape<layer::Vec3d, double, 3> {};
template <> struct Shape<layer::Vec4d> : VectorShape<layer::Vec4d, double, 4> {};
template <> struct Shape<layer::QuatHalf> : QuatShape<layer::QuatHalf, layer::Float16> {};
template <> struct Shape<layer::QuatFloat> : QuatShape<layer::QuatFloat, float> {};
template <> struct Shape<layer::QuatDouble> : QuatShape<layer::QuatDouble, double> {};
template <> struct Shape<layer::Mat2d> : MatrixShape<layer::Mat2d, 2> {};
template <> struct Shape<layer::Mat3d> : MatrixShape<layer::Mat3d, 3> {};
template <> struct Shape<layer::Mat4d> : MatrixShape<layer::Mat4d, 4> {};

// clang-format on

template <class To, class From>
To convert_number(From x) {
    if constexpr (std::is_same_v<To, From>) {
        return x;
    } else if constexpr (std::is_same_v<To, bool>) {
        return x != From(0);
    } else if constexpr (std::is_same_v<To, layer::Float16>) {
        return To(static_cast<float>(x));
    } else if constexpr (std::is_same_v<From, layer::Float16>) {
        return static_cast<To>(float(x));
    } else if constexpr (std::is_integral_v<To> && std::is_floating_point_v<From>) {
        // Out of range is undefined in C++: clamp
        const double d = double(x);
        if (std::isnan(d)) return To(0);
        if (d <= double(std::numeric_limits<To>::min())) return std::numeric_limits<To>::min();
        if (d >= double(std::numeric_limits<To>::max())) return std::numeric_limits<To>::max();
        return static_cast<To>(x);
    } else {
        return static_cast<To>(x);
    }
}

template <class To, class From>
constexpr bool is_convertible = Shape<To>::group != Group::None&& Shape<To>::group ==
                                Shape<From>::group&& Shape<To>::count == Shape<From>::count;

template <class To, class From>
To convert(const From& from) {
    To to{};
    for (int i = 0; i < Shape<To>::count; ++i) {
        Shape<To>::set(to, i,
                       convert_number<typename Shape<To>::Number>(Shape<From>::get(from, i)));
    }
    return to;
}

/// Calls f with a null pointer of the C++ type of a numeric ValueType; false for other types.
template <class F>
bool visit_numeric(ValueType type, const F& f) {
    bool found = false;
    const auto try_type = [&](auto* null) {
        using T = std::remove_pointer_t<decltype(null)>;
        if constexpr (Shape<T>::group != Group::None) {
            if (!found && layer::value_type_of<T> == type) {
                found = true;
                f(null);
            }
        }
    };
    [&]<size_t... I>(std::index_sequence<I...>) {
        (try_type(static_cast<std::tuple_element_t<I, layer::ValueTypeList>*>(nullptr)), ...);
    }
    (std::make_index_sequence<size_t(ValueType::Matrix4d) + 1>());
    return found;
}

/// The text of a string, token or asset scalar.
const std::string* text_of(const Value& v) {
    if (const auto* s = v.get_if<std::string>()) return s;
    if (const auto* t = v.get_if<layer::Token>()) return &t->str();
    if (const auto* a = v.get_if<layer::AssetPath>()) return &a->path;
    return nullptr;
}

template <class T>
constexpr bool is_text = std::is_same_v<T, std::string> || std::is_same_v<T, layer::Token> ||
                         std::is_same_v<T, layer::AssetPath>;

template <class T>
T text_as(const std::string& text) {
    if constexpr (std::is_same_v<T, layer::AssetPath>) {
        return {text};
    } else {
        return T(text);
    }
}

template <class T>
std::optional<T> cast_scalar(const Value& value) {
    if (value.is_array()) return std::nullopt;
    if (const T* exact = value.get_if<T>()) return *exact;
    if constexpr (is_text<T>) {
        if (const std::string* text = text_of(value)) return text_as<T>(*text);
        return std::nullopt;
    } else {
        std::optional<T> result;
        if constexpr (std::is_same_v<T, double> || std::is_same_v<T, float>) {
            if (const auto* t = value.get_if<layer::TimeCodeValue>()) return T(t->value);
        }
        visit_numeric(value.type(), [&](auto* null) {
            using From = std::remove_pointer_t<decltype(null)>;
            if constexpr (is_convertible<T, From>) result = convert<T, From>(*value.get_if<From>());
        });
        return result;
    }
}

template <class T>
std::optional<std::vector<T>> cast_array(const Value& value) {
    if (!value.is_array()) return std::nullopt;
    if (value.holds_array<T>()) {
        const auto span = value.as_array<T>();
        return std::vector<T>(span.begin(), span.end());
    }
    std::optional<std::vector<T>> result;
    if constexpr (is_text<T>) {
        const auto copy = [&](const auto& from, const auto& text) {
            result.emplace();
            for (const auto& element : from) result->push_back(text_as<T>(text(element)));
        };
        if (value.holds_array<std::string>()) {
            copy(value.as_array<std::string>(), [](const std::string& s) { return s; });
        } else if (value.holds_array<layer::Token>()) {
            copy(value.as_array<layer::Token>(), [](const layer::Token& t) { return t.str(); });
        } else if (value.holds_array<layer::AssetPath>()) {
            copy(value.as_array<layer::AssetPath>(),
                 [](const layer::AssetPath& a) { return a.path; });
        }
    } else {
        visit_numeric(value.type(), [&](auto* null) {
            using From = std::remove_pointer_t<decltype(null)>;
            if constexpr (is_convertible<T, From>) {
                const auto from = value.as_array<From>();
                result.emplace();
                result->reserve(from.size());
                for (const From& element : from) result->push_back(convert<T, From>(element));
            }
        });
    }
    return result;
}

// ---- Interpolation ----

template <class T>
constexpr bool is_float_element = [] {
    if constexpr (Shape<T>::group == Group::None) {
        return false;
    } else {
        return !std::is_integral_v<typename Shape<T>::Number>;
    }
}();

template <class T>
T lerp_element(const T& a, const T& b, double u) {
    using Number = typename Shape<T>::Number;
    T result{};
    for (int i = 0; i < Shape<T>::count; ++i) {
        const double x = convert_number<double>(Shape<T>::get(a, i));
        const double y = convert_number<double>(Shape<T>::get(b, i));
        Shape<T>::set(result, i, convert_number<Number>((1.0 - u) * x + u * y));
    }
    return result;
}

/// Great arc between unit quaternions, the short way round. Ref: Shoemake 1985, "Animating Rotation
/// with Quaternion Curves".
template <class T>
T slerp_element(const T& a, const T& b, double u) {
    using Number = typename Shape<T>::Number;
    double x[4], y[4];
    double cosine = 0.0;
    for (int i = 0; i < 4; ++i) {
        x[i] = convert_number<double>(Shape<T>::get(a, i));
        y[i] = convert_number<double>(Shape<T>::get(b, i));
        cosine += x[i] * y[i];
    }
    const double side = cosine < 0.0 ? -1.0 : 1.0;
    cosine *= side;
    double wa = 1.0 - u;
    double wb = u;
    if (cosine < 1.0 - 1e-10) {
        const double angle = std::acos(std::min(1.0, cosine));
        wa = std::sin((1.0 - u) * angle) / std::sin(angle);
        wb = std::sin(u * angle) / std::sin(angle);
    }
    T result{};
    for (int i = 0; i < 4; ++i)
        Shape<T>::set(result, i, convert_number<Number>(wa * x[i] + side * wb * y[i]));
    return result;
}

template <class T>
T blend(const T& a, const T& b, double u) {
    if constexpr (Shape<T>::group == Group::Quaternion) {
        return slerp_element(a, b, u);
    } else {
        return lerp_element(a, b, u);
    }
}

}  // namespace

bool is_interpolable(const Value& value) {
    if (value.type() == ValueType::TimeCode) return true;
    bool result = false;
    visit_numeric(value.type(), [&](auto* null) {
        result = is_float_element<std::remove_pointer_t<decltype(null)>>;
    });
    return result;
}

Value interpolate(const Value& a, const Value& b, double u) {
    if (u <= 0.0 || a.type() != b.type() || a.is_array() != b.is_array() ||
        a.array_size() != b.array_size()) {
        return a;
    }
    if (a.holds<layer::TimeCodeValue>()) {
        const double x = a.get_if<layer::TimeCodeValue>()->value;
        const double y = b.get_if<layer::TimeCodeValue>()->value;
        return Value(layer::TimeCodeValue{(1.0 - u) * x + u * y});
    }
    Value result = a;
    visit_numeric(a.type(), [&](auto* null) {
        using T = std::remove_pointer_t<decltype(null)>;
        if constexpr (is_float_element<T>) {
            if (!a.is_array()) {
                result = Value(blend<T>(*a.get_if<T>(), *b.get_if<T>(), u));
                return;
            }
            const auto x = a.as_array<T>();
            const auto y = b.as_array<T>();
            std::vector<T> elements(x.size());
            for (size_t i = 0; i < x.size(); ++i) elements[i] = blend<T>(x[i], y[i], u);
            result = Value::array(std::move(elements));
        }
    });
    return result;
}

Value retime_value(const Value& value, const layer::LayerOffset& to_stage) {
    if (to_stage.is_identity()) return value;
    if (const auto* t = value.get_if<layer::TimeCodeValue>()) {
        return Value(layer::TimeCodeValue{to_stage.apply(t->value)});
    }
    if (value.holds_array<layer::TimeCodeValue>()) {
        std::vector<layer::TimeCodeValue> times;
        for (const auto& t : value.as_array<layer::TimeCodeValue>())
            times.push_back({to_stage.apply(t.value)});
        return Value::array(std::move(times));
    }
    if (const auto* dictionary = value.get_if<layer::Dictionary>()) {
        layer::Dictionary retimed = *dictionary;
        for (auto& entry : retimed.entries) entry.second = retime_value(entry.second, to_stage);
        return Value(std::move(retimed));
    }
    return value;
}

#define VELATURA_DEFINE_CAST(T)                                                    \
    template <>                                                                    \
    std::optional<T> value_cast<T>(const Value& value) {                           \
        return cast_scalar<T>(value);                                              \
    }                                                                              \
    template <>                                                                    \
    std::optional<std::vector<T>> value_cast<std::vector<T>>(const Value& value) { \
        return cast_array<T>(value);                                               \
    }
VELATURA_CAST_TYPES(VELATURA_DEFINE_CAST)
#undef VELATURA_DEFINE_CAST

}  // namespace velatura::usd::stage
