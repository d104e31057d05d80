// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <type_traits>
#include <utility>

namespace contact_flow {
namespace python {

/// How values cross processes: those of plain numbers by their fields, answers by the question.

namespace pickles {

template <class T>
auto Plain(const T& field) {
  if constexpr (std::is_enum_v<T>) {
    return static_cast<int>(field);
  } else {
    return T(field);
  }
}

template <class T>
void Assign(const pybind11::handle& value, T* field) {
  if constexpr (std::is_enum_v<T>) {
    *field = static_cast<T>(value.cast<int>());
  } else {
    *field = value.cast<T>();
  }
}

}  // namespace pickles

/// Pickles a struct as the tuple of these fields.
template <class T, class... Fields>
auto PickledFields(Fields T::*... fields) {
  return pybind11::pickle(
      [fields...](const T& value) {
        return pybind11::make_tuple(pickles::Plain(value.*fields)...);
      },
      [fields...](const pybind11::tuple& state) {
        T value;
        std::size_t k = 0;
        (pickles::Assign(state[k++], &(value.*fields)), ...);
        return value;
      });
}

/// The question that an answer came of: asking `owner` again gives the same, to the bit.
struct Question {
  pybind11::object ask;    ///< a picklable function of the owner
  pybind11::object owner;  ///< whom was asked

  /// owner.name(*arguments, **keywords). What is given is kept: it must be the caller's own.
  template <class... Arguments>
  static Question Call(pybind11::object owner, const char* name, Arguments&&... arguments) {
    return {pybind11::module_::import("operator")
                .attr("methodcaller")(name, std::forward<Arguments>(arguments)...),
            std::move(owner)};
  }
  /// owner.name
  static Question Get(pybind11::object owner, const char* name) {
    return {pybind11::module_::import("operator").attr("attrgetter")(name), std::move(owner)};
  }
};

/// Pickles a class by its member `question`; its values are constant, copies are themselves.
template <class Class>
void PickleQuestion(Class* bound) {
  using T = typename Class::type;
  bound->def("__reduce__", [](const T& value) {
    return pybind11::make_tuple(value.question.ask, pybind11::make_tuple(value.question.owner));
  });
  bound->def("__copy__", [](const pybind11::object& self) { return self; });
  bound->def("__deepcopy__",
             [](const pybind11::object& self, const pybind11::object&) { return self; });
}

/// A copy of what was given, which later changes of it do not reach.
inline pybind11::object OwnCopy(const pybind11::handle& given) {
  return pybind11::module_::import("copy").attr("deepcopy")(given);
}

}  // namespace python
}  // namespace contact_flow
