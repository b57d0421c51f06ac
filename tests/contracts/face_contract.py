"""Import contract: a package is imported through its face, its ``__init__.py``, not through its modules."""

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class FaceContract(Contract):
    """Modules outside a package import the package itself; its modules import each other directly.

    Options:
        roots: top-level packages that are checked.
        exposed: modules that their package's face offers as namespaces.
    """

    type_name = "face"
    roots = fields.SetField(subfield=fields.StringField())
    exposed = fields.SetField(subfield=fields.StringField(), required=False)

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Find every import of a module that bypasses the face of its package."""
        exposed = self.exposed or set()
        found = sorted(
            (importer, imported)
            for importer in graph.modules
            for imported in graph.find_modules_directly_imported_by(importer)
            if imported not in exposed and self._bypasses_face(graph, importer, imported)
        )
        return ContractCheck(kept=not found, metadata={"imports": found})

    def _bypasses_face(self, graph: ImportGraph, importer: str, imported: str) -> bool:
        package = imported.rpartition(".")[0]
        if imported.partition(".")[0] not in self.roots or not package or graph.find_children(imported):
            return False
        return importer != package and not importer.startswith(f"{package}.")

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print each import with the package to import instead."""
        for importer, imported in check.metadata["imports"]:
            package = imported.rpartition(".")[0]
            output.print_error(f"{importer} imports {imported}: import it from {package} instead")
