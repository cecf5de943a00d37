#pragma once

#include "core/config/document.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/python/bindings.hpp"

#include <memory>
#include <string>
#include <utility>

namespace solenoid {

/// Where a campaign comes from: a file or shipped name, or its text where that is not empty.
struct CampaignSource {
  std::string path, text;
  Selection selection = {};

  std::shared_ptr<const Document> document() const {
    return text.empty() ? nullptr : std::make_shared<const Document>(Document::from_text(text, path));
  }
  Campaign read() const {
    const auto own = document();
    return own ? read_campaign(*own, selection) : read_campaign(path, selection);
  }
};

/// Ends a function of Python as Ctrl-C does.
[[noreturn]] inline void raise_keyboard_interrupt() {
  PyErr_SetNone(PyExc_KeyboardInterrupt);
  throw py::error_already_set();
}

/// Long work: other threads of Python go on meanwhile, and Ctrl-C raises InterruptGuard's flag, which the work looks
/// at.
template <class Work>
auto interruptible(Work&& work) {
  const py::gil_scoped_release released;
  const InterruptGuard guard;
  return std::forward<Work>(work)();
}

/// An array of a shape, filled row by row from what `next()` gives.
template <class T, class Next>
py::array_t<T> filled(std::vector<py::ssize_t> shape, Next next) {
  py::array_t<T> array(std::move(shape));
  T* const first = array.mutable_data();
  for (py::ssize_t i = 0; i < array.size(); ++i) first[i] = static_cast<T>(next(static_cast<std::size_t>(i)));
  return array;
}

}  // namespace solenoid
