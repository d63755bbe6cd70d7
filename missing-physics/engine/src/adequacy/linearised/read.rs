//! What a data vector says of the model and of its alternatives.

use super::plane::{Alternative, Linearised, Products, Reading};

impl Linearised<'_> {
    /// Fits the model and every alternative to a data vector (`[run][channel]`, measured rows).
    pub(crate) fn read(&self, data: &[Vec<Vec<f64>>]) -> Reading {
        self.read_products(&self.products(data))
    }

    /// The same of several data vectors.
    pub(crate) fn read_each(&self, data: &[&[Vec<Vec<f64>>]]) -> Vec<Reading> {
        self.products_of_each(data).iter().map(|products| self.read_products(products)).collect()
    }

    fn read_products(&self, products: &Products) -> Reading {
        let (nuisance, shared) = self.columns_with(0);
        let start = self.white_start(products);
        let (score, noise, coefficients) = self.alternate(products, &nuisance, &shared, &start, 8);
        let gain = |(alternative, measurable): (_, &bool)| {
            // Beside an alternative that leaves nothing of the data there is no noise to measure it by.
            if *measurable { self.gain(products, (&nuisance, &shared), &noise, alternative) } else { 0.0 }
        };
        let gains = self.alternatives.iter().zip(&self.measurable).map(gain).collect();
        let of_channel = |channel| self.noises(products, channel, (&nuisance, &shared), &coefficients);
        let noises = (0..self.problem.channels()).map(of_channel).collect();
        let coefficients = self.solve_by_run(products, &coefficients.noise, &nuisance, &shared);
        Reading { score, gains, noise, noises, coefficients }
    }

    /// Shape in play and sigma of the noise that the model alone leaves of a data vector, by channel.
    pub(crate) fn noise(&self, data: &[Vec<Vec<f64>>]) -> Vec<(usize, f64)> {
        let products = self.products(data);
        let (nuisance, shared) = self.columns_with(0);
        self.alternate(&products, &nuisance, &shared, &self.white_start(&products), 8).1
    }

    /// By how much an alternative lowers the sum of squares that the model alone leaves, in units of the noise that is left beside the
    /// alternative; nothing where its coefficient has the wrong sign.
    fn gain(
        &self,
        products: &Products,
        (nuisance, shared): (&[usize], &[usize]),
        noise: &[(usize, f64)],
        alternative: &Alternative,
    ) -> f64 {
        let with_nuisance = [nuisance, &alternative.nuisance].concat();
        let with_shared = [shared, &alternative.shared].concat();
        let (_, beside, _) = self.alternate(products, &with_nuisance, &with_shared, noise, 4);
        let x = self.solve(products, &beside, &with_nuisance, &with_shared);
        let wrong =
            alternative.sign != 0.0 && x.shared.last().is_some_and(|value| value * alternative.sign < 0.0);
        if wrong {
            return 0.0;
        }
        let with = self.chi2(products, &beside, &with_nuisance, &with_shared, &x);
        let without = self.solve(products, &beside, nuisance, shared);
        (self.chi2(products, &beside, nuisance, shared, &without) - with).max(0.0)
    }

    /// The residual of a data vector under the model alone, `[run][channel]`.
    pub(crate) fn residual(&self, data: &[Vec<Vec<f64>>], reading: &Reading) -> Vec<Vec<Vec<f64>>> {
        let used = self.n_nuisance + self.n_shared;
        let column = |run: usize, channel: usize, measured: &[f64]| {
            let mut left = measured.to_vec();
            let fitted = self.blocks[run][channel].raw[..used].iter().zip(&reading.coefficients[run]);
            for (column, x) in fitted {
                left.iter_mut().zip(column).for_each(|(v, c)| *v -= x * c);
            }
            left
        };
        let of_run = |(run, row): (usize, &Vec<Vec<f64>>)| {
            row.iter().enumerate().map(|(channel, measured)| column(run, channel, measured)).collect()
        };
        data.iter().enumerate().map(of_run).collect()
    }

    /// A channel of a residual by run, whitened and in units of a noise: its shape in play and its sigma.
    pub(crate) fn whitened(
        &self,
        residual: &[Vec<Vec<f64>>],
        channel: usize,
        (shape, sigma): (usize, f64),
    ) -> Vec<Vec<f64>> {
        let of_run = |(run, row): (usize, &Vec<Vec<f64>>)| {
            let mut column = row[channel].clone();
            self.problem.whitener(run, channel, self.in_play[shape]).whiten(&mut column);
            column.iter_mut().for_each(|v| *v /= sigma);
            column
        };
        residual.iter().enumerate().map(of_run).collect()
    }
}
