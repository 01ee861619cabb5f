//! A Hamiltonian network as an expression.

use super::{Hnn, HnnNet};
use crate::models::NetworkShape;
use crate::models::delan::Delan;
use crate::models::lnn::{Lnn, LnnShape};
use lagrangian_mechanics::expression::{Equations, Flow, Graph, Hamiltonian, Value, network};
use lagrangian_mechanics::forces::Applied;
use lagrangian_motion::Result;

impl Hnn {
    /// Hamilton's equations under these forces, or those of a flow.
    pub(crate) fn equations(&self, graph: Graph, applied: &Applied<'_>) -> Result<Equations> {
        // Both kinds of network are scalars of (q, z): a Lagrangian with these weights is an equal function.
        match &self.shape.net {
            HnnNet::Free(lnn) => {
                let same = Lnn::assemble(lnn.clone(), self.parameters.clone())?;
                self.by_scalar(graph, applied, |q, p| same.expression(q, p))
            }
            HnnNet::Mass(delan) => {
                let same = Delan::assemble(delan.clone(), self.parameters.clone())?;
                self.by_scalar(graph, applied, |q, p| same.expression(q, p))
            }
            HnnNet::None(shape) => {
                let coordinates = self.shape.coordinates();
                let flow = Flow::of(graph, coordinates, Some(applied), |[q, z, _]| {
                    self.plain_rates(shape, q, z)
                })?;
                Ok(Equations::Flow(flow))
            }
        }
    }

    /// The equations of H(q, z), a flow where z are velocities.
    fn by_scalar(
        &self,
        graph: Graph,
        applied: &Applied<'_>,
        write: impl for<'g> Fn(Value<'g>, Value<'g>) -> Value<'g>,
    ) -> Result<Equations> {
        let n = self.shape.dof();
        if self.shape.config.momenta.canonical() {
            let hamiltonian = Hamiltonian::of(graph, n, applied, write)?;
            return Ok(Equations::Hamiltonian(hamiltonian));
        }
        let flow = Flow::of(
            graph,
            self.shape.coordinates(),
            Some(applied),
            |[q, z, _]| {
                let h = write(q, z);
                [h.gradient(z), -h.gradient(q)]
            },
        )?;
        Ok(Equations::Flow(flow))
    }

    /// q̇ and ż of a network that computes them in the units of the data.
    fn plain_rates<'g>(&self, shape: &LnnShape, q: Value<'g>, z: Value<'g>) -> [Value<'g>; 2] {
        let (graph, n, scaling) = (q.graph(), q.len(), &shape.scaling);
        let units = graph.constant(&scaling.qd_scale);
        let features = [
            scaling.features_of(&shape.coordinates, q),
            z * (graph.number(1.0) / units),
        ];
        let o = network(&shape.net, &self.parameters, graph.join(&features), None);
        let forces = graph.number(scaling.energy) / graph.constant(&scaling.q_scale);
        [o.slice(0, n) * units, o.slice(n, n) * forces]
    }
}
