//! Distance correlation in O(n log n).

/// Distance correlation of two samples (Székely, Rizzo and Bakirov 2007, doi:10.1214/009053607000000505), the version whose means
/// run over all pairs, those of a point with itself included; 0 to 1, and 0 where one of the two does not vary. Lists of
/// different length are cut to the shorter.
///
/// The double sum of `|x_i - x_j| |y_i - y_j|` is taken in order of x with running sums over the ranks of y (as Huo and Székely
/// 2016, doi:10.1080/00401706.2015.1054435), the others after sorting.
pub fn distance_correlation(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len().min(y.len());
    if n < 2 {
        return 0.0;
    }
    let (x, y) = (centred(&x[..n]), centred(&y[..n]));
    let (rows_x, rows_y) = (row_sums(&x), row_sums(&y));
    let of = |products: f64, a: &[f64], b: &[f64]| {
        let n = n as f64;
        let rows: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
        let (a, b) = (a.iter().sum::<f64>(), b.iter().sum::<f64>());
        products / (n * n) - 2.0 * rows / (n * n * n) + a * b / (n * n * n * n)
    };
    // All squares of differences: 2 n sum x^2 - 2 (sum x)^2, and the sum is 0.
    let squares = |v: &[f64]| 2.0 * n as f64 * v.iter().map(|v| v * v).sum::<f64>();
    let variances = of(squares(&x), &rows_x, &rows_x) * of(squares(&y), &rows_y, &rows_y);
    let covariance = of(products(&x, &y), &rows_x, &rows_y);
    if variances > 0.0 { (covariance / variances.sqrt()).clamp(0.0, 1.0).sqrt() } else { 0.0 }
}

fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| v - mean).collect()
}

fn order(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|&a, &b| values[a].total_cmp(&values[b]));
    order
}

/// Sum of the distances from each value to all.
fn row_sums(values: &[f64]) -> Vec<f64> {
    let (n, total) = (values.len() as f64, values.iter().sum::<f64>());
    let mut sums = vec![0.0; values.len()];
    let mut below = 0.0;
    for (rank, &i) in order(values).iter().enumerate() {
        let v = values[i];
        sums[i] = total - 2.0 * below + (2.0 * rank as f64 - n) * v;
        below += v;
    }
    sums
}

/// Sum of `|x_i - x_j| |y_i - y_j|` over all i and j.
fn products(x: &[f64], y: &[f64]) -> f64 {
    let mut rank = vec![0; y.len()];
    for (k, &i) in order(y).iter().enumerate() {
        rank[i] = k;
    }
    // Number, sum of x, of y, of x y: of all so far, and of those below a rank (a Fenwick tree).
    let mut all = [0.0; 4];
    let mut tree = vec![[0.0; 4]; y.len() + 1];
    let mut sum = 0.0;
    for i in order(x) {
        let (a, b) = (x[i], y[i]);
        let signed = |s: &[f64; 4]| a * b * s[0] - b * s[1] - a * s[2] + s[3];
        let mut below = [0.0; 4];
        let mut k = rank[i];
        while k > 0 {
            below = std::array::from_fn(|m| below[m] + tree[k][m]);
            k &= k - 1;
        }
        // What lies above in y has the other sign.
        sum += 2.0 * signed(&below) - signed(&all);
        let of_point = [1.0, a, b, a * b];
        all = std::array::from_fn(|m| all[m] + of_point[m]);
        let mut k = rank[i] + 1;
        while k < tree.len() {
            tree[k] = std::array::from_fn(|m| tree[k][m] + of_point[m]);
            k += k & k.wrapping_neg();
        }
    }
    2.0 * sum
}
