#pragma once

#include <cstddef>
#include <iterator>

namespace solenoid {

/// Walks a list whose elements are made when they are asked for: what it points to are values.
template <class List, class Value>
class IndexIterator {
 public:
  using value_type = Value;
  using difference_type = std::ptrdiff_t;
  using iterator_concept = std::forward_iterator_tag;
  using iterator_category = std::input_iterator_tag;  // before C++20 others have to point to references
  using reference = Value;
  using pointer = void;

  IndexIterator() = default;
  IndexIterator(const List& list, std::size_t at) : list_(&list), at_(at) {}

  Value operator*() const { return (*list_)[at_]; }
  IndexIterator& operator++() {
    ++at_;
    return *this;
  }
  IndexIterator operator++(int) {
    const IndexIterator before = *this;
    ++at_;
    return before;
  }
  bool operator==(const IndexIterator& other) const { return at_ == other.at_; }

 private:
  const List* list_ = nullptr;
  std::size_t at_ = 0;
};

}  // namespace solenoid
