#include "regression/libsvm_solver.hpp"

#include <fmt/format.h>
#include <libsvm/svm.h>

namespace thermbal {
namespace {

struct ModelDeleter {
    void operator()(svm_model* model) const { svm_free_and_destroy_model(&model); }
};

svm_parameter libsvm_parameters(const SvrParameters& parameters) {
    svm_parameter libsvm{};
    libsvm.svm_type = EPSILON_SVR;
    libsvm.kernel_type = PRECOMPUTED;
    libsvm.cache_size = 64.0;
    libsvm.eps = parameters.tolerance;
    libsvm.C = parameters.C;
    libsvm.p = parameters.epsilon;
    libsvm.shrinking = 1;
    return libsvm;
}

void silence_libsvm() {
    static const bool silent = [] {
        svm_set_print_string_function([](const char*) {});
        return true;
    }();
    static_cast<void>(silent);
}

}  // namespace

struct LibsvmSolver::Nodes {
    std::vector<svm_node> elements;
    std::size_t stride = 0;

    svm_node* row(std::size_t index) { return elements.data() + index * stride; }
};

LibsvmSolver::LibsvmSolver(const Eigen::MatrixXd& kernel) : nodes_(std::make_unique<Nodes>()) {
    silence_libsvm();
    const auto rows = static_cast<std::size_t>(kernel.rows());
    nodes_->stride = rows + 1;
    nodes_->elements.resize(rows * nodes_->stride);
    for (std::size_t i = 0; i < rows; ++i) {
        svm_node* node = nodes_->row(i);
        // libsvm looks a precomputed element up as row i at the serial number of row j: subsets share the
        // rows.
        *node++ = {0, static_cast<double>(i + 1)};
        for (std::size_t j = 0; j < rows; ++j) {
            *node++ = {static_cast<int>(j + 1),
                       kernel(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i))};
        }
    }
}

LibsvmSolver::~LibsvmSolver() = default;
LibsvmSolver::LibsvmSolver(LibsvmSolver&&) noexcept = default;
LibsvmSolver& LibsvmSolver::operator=(LibsvmSolver&&) noexcept = default;

Result<SvrFit> LibsvmSolver::fit(std::span<const std::size_t> rows, std::span<const double> targets,
                                 const SvrParameters& parameters) const {
    std::vector<double> y;
    std::vector<svm_node*> x;
    for (const std::size_t row : rows) {
        y.push_back(targets[row]);
        x.push_back(nodes_->row(row));
    }
    const svm_problem problem{static_cast<int>(rows.size()), y.data(), x.data()};
    const svm_parameter libsvm = libsvm_parameters(parameters);
    if (const char* complaint = svm_check_parameter(&problem, &libsvm)) {
        return fail(NextStep::refuse_input, fmt::format("libsvm refuses the parameters: {}", complaint));
    }
    const std::unique_ptr<svm_model, ModelDeleter> model(svm_train(&problem, &libsvm));
    if (!model) return fail(NextStep::stop, "libsvm gave no model");
    SvrFit fit;
    fit.coefficient.assign(rows.size(), 0.0);
    for (int k = 0; k < model->l; ++k) {
        fit.coefficient[static_cast<std::size_t>(model->sv_indices[k] - 1)] = model->sv_coef[0][k];
    }
    fit.bias = -model->rho[0];
    return fit;
}

}  // namespace thermbal
