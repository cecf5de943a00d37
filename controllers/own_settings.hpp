#pragma once

#include <concepts>
#include <memory>
#include <typeinfo>
#include <utility>

namespace solenoid {

/// Settings that a system alone knows, inside data that serves every system: a value of any type, copied with its
/// holder; of a type without == two are equal only if they are the same. One that holds nothing stands for the type's defaults.
class OwnSettings {
 public:
  OwnSettings() = default;
  OwnSettings(const OwnSettings& other) : held_(other.held_ ? other.held_->copy() : nullptr) {}
  OwnSettings(OwnSettings&&) noexcept = default;
  OwnSettings& operator=(OwnSettings other) noexcept {
    held_ = std::move(other.held_);
    return *this;
  }
  ~OwnSettings() = default;

  /// The settings, which are T's: throws std::bad_cast if they are another type's.
  template <class T>
  const T& as() const {
    static const T defaults{};
    return held_ ? dynamic_cast<const Of<T>&>(*held_).value : defaults;
  }
  /// The same, to be changed.
  template <class T>
  T& as() {
    if (!held_) held_ = std::make_unique<Of<T>>();
    return dynamic_cast<Of<T>&>(*held_).value;
  }

  bool operator==(const OwnSettings& other) const {
    if (!held_ || !other.held_) return !held_ && !other.held_;
    return held_->equals(*other.held_);
  }

 private:
  struct Any {
    virtual ~Any() = default;
    virtual std::unique_ptr<Any> copy() const = 0;
    virtual bool equals(const Any& other) const = 0;
  };
  template <class T>
  struct Of final : Any {
    std::unique_ptr<Any> copy() const override { return std::make_unique<Of>(*this); }
    bool equals(const Any& other) const override {
      const auto* same = dynamic_cast<const Of*>(&other);
      if constexpr (std::equality_comparable<T>)
        return same && same->value == value;
      else
        return same == this;
    }
    T value{};
  };

  std::unique_ptr<Any> held_;
};

}  // namespace solenoid
