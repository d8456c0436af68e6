// SPDX-License-Identifier: Apache-2.0
#include "python/conversions.h"

#include "python/session.h"
#include "usd/layer/spline.h"
#include "usd/stage/dump.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <exception>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

namespace py = pybind11;

namespace velatura::python {

namespace {

using namespace usd::layer;

std::string text_of(const py::handle& value) {
    if (py::hasattr(value, "__fspath__"))
        return py::str(py::module_::import("os").attr("fspath")(value));
    return py::str(value);
}

bool is_truth(const py::handle& value) {
    return PyBool_Check(value.ptr()) != 0 ||
           std::string_view(Py_TYPE(value.ptr())->tp_name) == "numpy.bool_";
}

/// What lies side by side in a value: its component and its shape.
template <class C, py::ssize_t... Shape>
struct NumbersOf {
    using Component = C;

    static std::vector<py::ssize_t> shape() { return {Shape...}; }
};

template <class T>
struct Numbers {
    using Component = void;
};

// clang-format off
template <> struct Numbers<bool> : NumbersOf<bool> {};
template <> struct Numbers<uint8_t> : NumbersOf<uint8_t> {};
template <> struct Numbers<int32_t> : NumbersOf<int32_t> {};
template <> struct Numbers<uint32_t> : NumbersOf<uint32_t> {};
template <> struct Numbers<int64_t> : NumbersOf<int64_t> {};
template <> struct Numbers<uint64_t> : NumbersOf<uint64_t> {};
template <> struct Numbers<Float16> : NumbersOf<Float16> {};
template <> struct Numbers<float> : NumbersOf<float> {};
template <> struct Numbers<double> : NumbersOf<double> {};
template <> struct Numbers<TimeCodeValue> : NumbersOf<double> {};
template <> struct Numbers<Vec2i> : NumbersOf<int, 2> {};
template <> struct Numbers<Vec3i> : NumbersOf<int, 3> {};
template <> struct Numbers<Vec4i> : NumbersOf<int, 4> {};
template <> struct Numbers<Vec2h> : NumbersOf<Float16, 2> {};
template <> struct Numbers<Vec3h> : NumbersOf<Float16, 3> {};
template <> struct Numbers<Vec4h> : NumbersOf<Float16, 4> {};
template <> struct Numbers<Vec2f> : NumbersOf<float, 2> {};
template <> struct Numbers<Vec3f> : NumbersOf<float, 3> {};
template <> struct Numbers<Vec4f> : NumbersOf<float, 4> {};
template <> struct Numbers<Vec2d> : NumbersOf<double, 2> {};
template <> struct Numbers<Vec3d> : NumbersOf<double, 3> {};
template <> struct Numbers<Vec4d> : NumbersOf<double, 4> {};
template <> struct Numbers<QuatHalf> : NumbersOf<Float16, 4> {};
template <> struct Numbers<QuatFloat> : NumbersOf<float, 4> {};
template <> struct Numbers<QuatDouble> : NumbersOf<double, 4> {};
template <> struct Numbers<Mat2d> : NumbersOf<double, 2, 2> {};
template <> struct Numbers<Mat3d> : NumbersOf<double, 3, 3> {};
template <> struct Numbers<Mat4d> : NumbersOf<double, 4, 4> {};

// clang-format on

template <class T>
py::dtype dtype_of() {
    if constexpr (std::is_same_v<T, Float16>)
        return py::dtype("e");
    else
        return py::dtype::of<T>();
}

py::str text_of(const std::string& text) {
    return py::str(text);
}

py::str text_of(const Token& token) {
    return py::str(token.str());
}

py::str text_of(const AssetPath& asset) {
    return py::str(asset.path);
}

py::str text_of(const PathExpression& expression) {
    return py::str(expression.text);
}

py::str text_of(const Path& path) {
    return py::str(path.to_string());
}

template <class T>
concept Text = std::is_same_v<T, std::string> || std::is_same_v<T, Token> ||
    std::is_same_v<T, AssetPath> || std::is_same_v<T, PathExpression> || std::is_same_v<T, Path>;

template <class C>
py::object number(const C& value) {
    if constexpr (std::is_same_v<C, Float16>)
        return py::float_(double(float(value)));
    else
        return py::cast(value);
}

template <class T>
py::object array_of(const Value& value) {
    using Component = typename Numbers<T>::Component;
    const std::span<const T> elements = value.as_array<T>();
    if constexpr (Text<T>) {
        py::list list;
        for (const T& element : elements) list.append(text_of(element));
        return list;
    } else {
        std::vector<py::ssize_t> shape = Numbers<T>::shape();
        shape.insert(shape.begin(), py::ssize_t(elements.size()));
        return shared_array(reinterpret_cast<const Component*>(elements.data()), std::move(shape),
                            dtype_of<Component>(), std::make_shared<const Value>(value));
    }
}

template <class T>
py::object scalar_of(const T& value) {
    if constexpr (Text<T>) {
        return text_of(value);
    } else if constexpr (std::is_same_v<T, bool>) {
        return py::bool_(value);
    } else {
        using Component = typename Numbers<T>::Component;
        const auto* first = reinterpret_cast<const Component*>(&value);
        const std::vector<py::ssize_t> shape = Numbers<T>::shape();
        if (shape.empty()) return number(*first);
        const auto row = [](const Component* begin, py::ssize_t count) {
            py::tuple numbers{static_cast<size_t>(count)};
            for (py::ssize_t i = 0; i < count; ++i) numbers[size_t(i)] = number(begin[i]);
            return numbers;
        };
        if (shape.size() == 1) return row(first, shape[0]);
        py::tuple rows{static_cast<size_t>(shape[0])};
        for (py::ssize_t r = 0; r < shape[0]; ++r)
            rows[size_t(r)] = row(first + r * shape[1], shape[1]);
        return rows;
    }
}

/// Sets `out` if the value is a T or an array of them.
template <class T>
bool convert_if(const Value& value, py::object& out) {
    if constexpr (Text<T> || !std::is_void_v<typename Numbers<T>::Component>) {
        if constexpr (is_attribute_type(value_type_of<T>)) {
            if (value.holds_array<T>()) {
                out = array_of<T>(value);
                return true;
            }
        }
        if (const T* scalar = value.get_if<T>()) {
            out = scalar_of(*scalar);
            return true;
        }
    }
    return false;
}

template <class... T>
bool convert_any(const Value& value, py::object& out, std::tuple<T...>*) {
    return (convert_if<T>(value, out) || ...);
}

template <class T>
bool list_if(const Value& value, py::object& out) {
    const ListOp<T>* const op = value.get_if<ListOp<T>>();
    if (!op) return false;
    py::list list;
    for (const T& item : op->applied()) list.append(scalar_of(item));
    out = list;
    return true;
}

[[noreturn]] void refuse(const TypeInfo& type, const std::string& why) {
    throw Failure(Failure::Kind::Usage, "usd-author",
                  fmt::format("a value of type {}: {}", type.name.str(), why));
}

std::string shape_text(const std::vector<py::ssize_t>& shape, bool is_array) {
    std::string text = is_array ? "n" : "";
    for (const py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
    return "[" + text + "]";
}

/// Components side by side, of an exact shape; a first axis of any length for arrays.
template <class T>
std::vector<T> numbers_from(const TypeInfo& type, const py::object& value) {
    using Component = typename Numbers<T>::Component;
    const py::object numpy = py::module_::import("numpy");
    const py::array given = numpy.attr("asarray")(value);
    const char kind = given.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
        refuse(type, "expected numbers, found " + std::string(py::str(given.dtype())));
    const std::vector<py::ssize_t> shape = Numbers<T>::shape();
    const std::vector<py::ssize_t> found(given.shape(), given.shape() + given.ndim());
    const size_t before = type.is_array ? 1 : 0;
    const bool fits = found.size() == before + shape.size() &&
                      std::equal(shape.begin(), shape.end(), found.begin() + long(before));
    const bool is_nothing = type.is_array && given.size() == 0;
    if (!fits && !is_nothing)
        refuse(type, fmt::format("expected the shape {}, found {}",
                                 shape_text(shape, type.is_array), shape_text(found, false)));
    const py::array cast = given.attr("astype")(dtype_of<Component>(), "C");
    if constexpr (std::is_integral_v<Component>) {
        if (!py::cast<bool>(numpy.attr("array_equal")(cast, given)))
            refuse(type, "values that it cannot hold");
    }
    const size_t count = is_nothing ? 0 : type.is_array ? size_t(found[0]) : 1;
    std::vector<T> out(count);
    if (count > 0) std::memcpy(static_cast<void*>(out.data()), cast.data(), count * sizeof(T));
    return out;
}

template <class T>
T text_from(const TypeInfo& type, const py::handle& value) {
    if (!PyUnicode_Check(value.ptr()) && !py::hasattr(value, "__fspath__"))
        refuse(type, "expected str, found " + std::string(py::str(py::type::of(value))));
    const std::string text = text_of(value);
    if constexpr (std::is_same_v<T, Path>)
        return Path::from(text);
    else if constexpr (std::is_same_v<T, AssetPath> || std::is_same_v<T, PathExpression>)
        return T{text};
    else
        return T(text);
}

template <class T>
bool make_if(const TypeInfo& type, const py::object& value, Value& out) {
    if constexpr ((Text<T> || !std::is_void_v<typename Numbers<T>::Component>)&&is_attribute_type(
                      value_type_of<T>)) {
        if (type.type != value_type_of<T>) return false;
        std::vector<T> elements;
        if constexpr (Text<T>) {
            if (type.is_array)
                for (const py::handle item : value) elements.push_back(text_from<T>(type, item));
            else
                elements.push_back(text_from<T>(type, value));
        } else {
            if constexpr (std::is_same_v<T, bool>) {
                for (const uint8_t b : numbers_from<uint8_t>(type, value))
                    elements.push_back(b != 0);
            } else {
                elements = numbers_from<T>(type, value);
            }
        }
        out = type.is_array ? Value::array<T>(std::move(elements)) : Value(T(elements.front()));
        return true;
    }
    return false;
}

template <class... T>
bool make_any(const TypeInfo& type, const py::object& value, Value& out, std::tuple<T...>*) {
    return (make_if<T>(type, value, out) || ...);
}

}  // namespace

Value from_python(const TypeInfo& type, const py::object& value) {
    Value out;
    if (!make_any(type, value, out, static_cast<ValueTypeList*>(nullptr)))
        refuse(type, "this type cannot be written");
    return out;
}

py::object from_json(const std::string& text) {
    return py::module_::import("json").attr("loads")(text);
}

std::string path_of(const py::object& path) {
    return py::str(py::module_::import("os").attr("fspath")(path));
}

std::vector<Keyword> keywords_of(const py::kwargs& kwargs) {
    std::vector<Keyword> keywords;
    for (const auto& [name, value] : kwargs) {
        if (value.is_none()) continue;
        Keyword keyword;
        keyword.name = py::str(name);
        if (is_truth(value)) {
            keyword.truth = PyObject_IsTrue(value.ptr()) == 1;
        } else if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value) ||
                   py::isinstance<py::array>(value)) {
            keyword.is_list = true;
            for (const py::handle item : value) keyword.values.push_back(text_of(item));
        } else {
            keyword.values.push_back(text_of(value));
        }
        keywords.push_back(std::move(keyword));
    }
    return keywords;
}

py::object to_python(const Value& value) {
    py::object out = py::none();
    if (value.is_empty() || value.is_block() || value.is_animation_block()) return out;
    if (convert_any(value, out, static_cast<ValueTypeList*>(nullptr))) return out;
    if (const Dictionary* const entries = value.get_if<Dictionary>()) {
        py::dict dict;
        for (const auto& [key, entry] : entries->entries) dict[py::str(key)] = to_python(entry);
        return dict;
    }
    if (const TimeSamples* const samples = value.get_if<TimeSamples>()) {
        py::dict dict;
        for (size_t i = 0; i < samples->size(); ++i)
            dict[py::float_(samples->times()[i])] = to_python(samples->value(i));
        return dict;
    }
    if (list_if<Token>(value, out) || list_if<std::string>(value, out) ||
        list_if<Path>(value, out) || list_if<int32_t>(value, out) || list_if<int64_t>(value, out))
        return out;
    // Types of fields of composition
    return py::str(usd::stage::dump_value(value));
}

py::array to_python(const std::shared_ptr<const LayerArrays>& layers, const LayerArray& array) {
    return std::visit(
        [&](const auto& values) {
            using T = typename std::decay_t<decltype(values)>::value_type;
            return shared_array(values.data(),
                                {py::ssize_t(layers->height()), py::ssize_t(layers->width()),
                                 py::ssize_t(array.channels.size())},
                                py::dtype::of<T>(), layers);
        },
        array.values);
}

py::list to_python(const std::vector<Message>& messages) {
    py::list list;
    for (const Message& message : messages) list.append(py::cast(message));
    return list;
}

void translate_failures() {
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Failure& failure) {
            if (failure.kind == Failure::Kind::Keyword) {
                PyErr_SetString(PyExc_TypeError, failure.what());
                return;
            }
            const char* const name = failure.kind == Failure::Kind::Usage      ? "UsageError"
                                     : failure.kind == Failure::Kind::Canceled ? "Canceled"
                                                                               : "Error";
            const py::object type = py::module_::import("velatura").attr(name);
            const py::object error = type(failure.what());
            error.attr("code") = failure.code;
            error.attr("diagnostics") = to_python(failure.messages);
            if (failure.kind == Failure::Kind::Canceled)
                error.attr("frame") = failure.frame ? py::cast(failure.frame) : py::none();
            PyErr_SetObject(type.ptr(), error.ptr());
        }
    });
}

}  // namespace velatura::python
