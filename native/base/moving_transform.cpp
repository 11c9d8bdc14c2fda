#include "base/moving_transform.h"

namespace cistern {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;
using Quaternion = std::array<double, 4>;

Matrix cofactors(const Matrix& m) {
  Matrix c;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) {
      const size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      c[i][j] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
    }
  return c;
}

double determinant(const Matrix& m) {
  const Matrix c = cofactors(m);
  return m[0][0] * c[0][0] + m[0][1] * c[0][1] + m[0][2] * c[0][2];
}

double norm(const Matrix& m) {
  double sum = 0.0;
  for (const auto& row : m)
    for (const double x : row) sum += x * x;
  return std::sqrt(sum);
}

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix p{};
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j)
      for (size_t k = 0; k < 3; ++k) p[i][j] += a[i][k] * b[k][j];
  return p;
}

Matrix transposed(const Matrix& m) {
  Matrix t;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) t[i][j] = m[j][i];
  return t;
}

/// The nearest orthogonal matrix, by Newton's iteration with scaling. [Higham 1986, Computing the Polar Decomposition]
Matrix orthogonal_part(Matrix m) {
  constexpr int kMostSteps = 100;  // about ten are needed
  constexpr double kEnough = 1e-12;
  for (int step = 0; step < kMostSteps; ++step) {
    Matrix inverse_transpose = cofactors(m);
    const double det = determinant(m);
    for (auto& row : inverse_transpose)
      for (double& x : row) x /= det;
    const double scale = std::sqrt(norm(inverse_transpose) / norm(m));
    double change = 0.0;
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j) {
        const double x = 0.5 * (scale * m[i][j] + inverse_transpose[i][j] / scale);
        change = std::max(change, std::abs(x - m[i][j]));
        m[i][j] = x;
      }
    if (change < kEnough) break;
  }
  return m;
}

/// Of a rotation; the largest component is found first. [Shepperd 1978]
Quaternion to_quaternion(const Matrix& m) {
  const std::array<double, 4> squares{1.0 + m[0][0] - m[1][1] - m[2][2], 1.0 - m[0][0] + m[1][1] - m[2][2],
                                      1.0 - m[0][0] - m[1][1] + m[2][2], 1.0 + m[0][0] + m[1][1] + m[2][2]};
  const auto largest = static_cast<size_t>(std::ranges::max_element(squares) - squares.begin());
  const double length = std::sqrt(squares[largest]);
  const double half = 0.5 / length;
  Quaternion q;
  if (largest == 3) {
    q = {m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 0.0};
  } else {
    const size_t i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    q[j] = m[j][i] + m[i][j];
    q[k] = m[k][i] + m[i][k];
    q[3] = m[k][j] - m[j][k];
  }
  for (double& x : q) x *= half;
  q[largest] = 0.5 * length;
  return q;
}

Matrix to_matrix(const Quaternion& q) {
  const auto& [x, y, z, w] = q;
  return {{{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)},
           {2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)},
           {2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)}}};
}

/// The shorter way round, at even speed; by a straight line where both are nearly equal.
Quaternion slerp(const Quaternion& a, Quaternion b, double t) {
  constexpr double kNearlyEqual = 1.0 - 1e-9;
  double cos_angle = 0.0;
  for (size_t i = 0; i < 4; ++i) cos_angle += a[i] * b[i];
  if (cos_angle < 0.0) {
    cos_angle = -cos_angle;
    for (double& x : b) x = -x;
  }
  double of_a = 1.0 - t, of_b = t;
  if (cos_angle < kNearlyEqual) {
    const double angle = std::acos(cos_angle), sin_angle = std::sin(angle);
    of_a = std::sin(of_a * angle) / sin_angle;
    of_b = std::sin(of_b * angle) / sin_angle;
  }
  Quaternion q;
  double length_squared = 0.0;
  for (size_t i = 0; i < 4; ++i) {
    q[i] = of_a * a[i] + of_b * b[i];
    length_squared += q[i] * q[i];
  }
  for (double& x : q) x /= std::sqrt(length_squared);
  return q;
}

}  // namespace

MovingTransform::MovingTransform(const Transform& start, const Transform& end)
    : start_(start), end_(end), turn_(turn(start, end)) {}

std::optional<MovingTransform::Turn> MovingTransform::turn(const Transform& start, const Transform& end) {
  const float of_start = start.determinant(), of_end = end.determinant();
  if (!std::isfinite(of_start) || !std::isfinite(of_end) || of_start == 0.0f || of_end == 0.0f ||
      (of_start < 0.0f) != (of_end < 0.0f))
    return std::nullopt;
  return Turn{decompose(start), decompose(end)};
}

MovingTransform::Parts MovingTransform::decompose(const Transform& transform) {
  Matrix linear;
  size_t row_index = 0;
  for (const Vec3 row : {transform.row_x, transform.row_y, transform.row_z})
    linear[row_index++] = {row.x, row.y, row.z};
  Matrix rotation = orthogonal_part(linear);
  if (determinant(rotation) < 0.0)
    for (auto& row : rotation)
      for (double& x : row) x = -x;
  return {to_quaternion(rotation), product(transposed(rotation), linear)};
}

Transform MovingTransform::at(float t) const {
  if (t <= 0.0f) return start_;
  if (t >= 1.0f) return end_;
  const Vec3 translation = lerp(start_.translation, end_.translation, t);
  if (!turn_)
    return {lerp(start_.row_x, end_.row_x, t), lerp(start_.row_y, end_.row_y, t), lerp(start_.row_z, end_.row_z, t),
            translation};
  Matrix stretch;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j)
      stretch[i][j] = std::lerp(turn_->start.stretch[i][j], turn_->end.stretch[i][j], static_cast<double>(t));
  const Matrix linear = product(to_matrix(slerp(turn_->start.rotation, turn_->end.rotation, t)), stretch);
  const auto row = [&](size_t i) {
    return Vec3{static_cast<float>(linear[i][0]), static_cast<float>(linear[i][1]), static_cast<float>(linear[i][2])};
  };
  return {row(0), row(1), row(2), translation};
}

}  // namespace cistern
